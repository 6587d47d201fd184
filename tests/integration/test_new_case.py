"""A stranger's recordings become a profile that can be run, and what is wrong with them is said."""

import re
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from ruamel.yaml import YAML

from odisar.config.loader import load_config
from odisar.recordings.reader import read_case
from odisar.workspaces import lay_out

from .strangers import rover, run, write_rovers

pytestmark = pytest.mark.usefixtures("root")


def test_a_table_with_semicolons_and_decimal_commas_becomes_a_profile_that_runs(
    root, folder, capsys
):
    write_rovers(folder)
    before = (root / "params.yaml").read_text()
    assert run("new-case", folder, "--name", "rover", "--write") == 0
    printed = capsys.readouterr()
    after = (root / "params.yaml").read_text()
    proposal = printed.out.removeprefix("profiles:\n")
    assert after.replace(proposal, "") == before
    assert "Quality check: no findings." in printed.err
    assert "odisar profile rover" in printed.err
    target = lay_out(root, "rover")
    case = load_config(target).cases["rover"]
    assert case.source.time_column == "Zeit [s]"
    assert (case.rate_hz, case.source.resample, case.splits.kind) == (4.0, "none", "fractions")
    roles = {channel.name: (channel.unit, channel.role) for channel in case.channels}
    assert roles == {
        "Lenkwinkel Soll [°]": ("deg", "command"),
        "v [m/s]": ("m/s", "state"),
        "yaw rate [deg/s]": ("deg/s", "state"),
    }
    assert case.output_names == case.faults.channels == ["v [m/s]", "yaw rate [deg/s]"]
    result = read_case("rover", case, target)
    assert len(result.recordings) == 12
    assert not [finding for finding in result.findings if finding.severity == "error"]


def test_what_is_printed_alone_can_be_pasted(root, folder, capsys):
    write_rovers(folder)
    assert run("new-case", folder) == 0
    printed = capsys.readouterr()
    section = YAML(typ="safe").load(printed.out)["profiles"]
    assert list(section) == ["pr-ffahrten-2024"]
    assert "--write" in printed.err
    assert "pr-ffahrten" not in (root / "params.yaml").read_text()


def test_a_second_proposal_of_the_same_name_is_refused(root, folder, capsys):
    write_rovers(folder, files=3)
    assert run("new-case", folder, "--name", "rover", "--write") == 0
    once = (root / "params.yaml").read_bytes()
    assert run("new-case", folder, "--name", "rover", "--write") == 1
    assert "profiles.rover is already in params.yaml" in capsys.readouterr().err
    assert (root / "params.yaml").read_bytes() == once


def test_one_long_parquet_with_jitter_a_gap_and_a_pose(root, folder, capsys):
    random = np.random.default_rng(1)
    samples = 6000
    seconds = np.arange(samples) / 20 + random.normal(0, 0.004, samples)
    seconds[samples // 2 :] += 47.0
    yaw = np.cumsum(random.normal(0, 0.02, samples))
    pd.DataFrame(
        {
            "timestamp": pd.to_datetime((1.7e9 + seconds) * 1e9),
            "x": np.cumsum(np.cos(yaw)) * 0.05,
            "y": np.cumsum(np.sin(yaw)) * 0.05,
            "yaw": (yaw + np.pi) % (2 * np.pi) - np.pi,
            "speed_mps": 1 + 0.05 * random.normal(size=samples),
            "throttle": np.repeat(random.uniform(0, 1, samples // 40), 40),
        }
    ).to_parquet(folder / "flight.parquet")
    assert run("new-case", folder, "--name", "quad", "--write") == 0
    assert "a gap" in capsys.readouterr().err
    case = load_config(lay_out(root, "quad")).cases["quad"]
    assert (case.rate_hz, case.splits.kind, case.source.resample) == (20.0, "cross-fit", "none")
    assert case.pose.model_dump() == {
        "x": "x", "y": "y", "heading": ["yaw"], "coordinates": "relative",
    }  # fmt: skip
    assert {"x", "y"} <= set(case.output_names)
    assert "yaw" not in case.output_names
    assert not {"x", "y", "yaw"} & set(case.faults.channels)


def test_a_window_chosen_on_the_command_line_is_proposed(folder, capsys):
    write_rovers(folder)
    chosen = ("--rate-hz", 2, "--context-s", 10, "--horizon-s", 5)
    assert run("new-case", folder, "--name", "rover", *chosen) == 0
    case = YAML(typ="safe").load(capsys.readouterr().out)["profiles"]["rover"]["cases"]["rover"]
    assert case["rate_hz"] == 2.0
    assert case["window"] == {"context_steps": 20, "horizon_steps": 10}


@pytest.mark.parametrize(
    ("change", "options", "told"),
    [
        (lambda t: t, {"encoding": "utf-16"}, "it is encoded in utf-16"),
        (
            lambda t: t.assign(**{"Zeit [s]": t["Zeit [s]"] * 1000}).rename(
                columns={"Zeit [s]": "Zeit [ms]"}
            ),
            {},
            "counts milliseconds",
        ),
        (
            lambda t: t.assign(
                Zeit=(
                    pd.Timestamp("2024-05-01T10:00") + pd.to_timedelta(t["Zeit [s]"], "s")
                ).dt.strftime("%Y-%m-%dT%H:%M:%S.%f")
            ).drop(columns="Zeit [s]"),
            {},
            r"holds dates as text \(2024-05-01T10:00:00",
        ),
    ],
)
def test_what_must_be_converted_comes_with_a_program_that_does_it(
    folder, capsys, change, options, told
):
    for seed in range(3):
        change(rover(seed)).to_csv(
            folder / f"{seed}.csv", sep=";", decimal=",", index=False, **options
        )
    assert run("new-case", folder, "--name", "rover") == 1
    error = capsys.readouterr().err
    assert re.search(told, error)
    program = re.search(r"<<'END'\n(.*)END\n", error, re.DOTALL)[1]
    subprocess.run([sys.executable, "-c", program], check=True)
    converted = folder.with_name(f"{folder.name}-converted")
    assert run("new-case", converted, "--name", "rover") == 0
    printed = capsys.readouterr()
    assert "Quality check: no findings." in printed.err
    case = YAML(typ="safe").load(printed.out)["profiles"]["rover"]["cases"]["rover"]
    assert (case["rate_hz"], len(case["channels"])) == (4.0, 3)


@pytest.mark.parametrize(
    ("files", "told"),
    [
        ({}, "holds no recording: put a CSV file"),
        ({"a.xlsx": "PK"}, r"there are only files of \.xlsx; export them"),
        ({"run/a.csv": "t,v\n0,1\n"}, "they seem to lie in 'run'"),
        ({"a.csv": ""}, r"a\.csv: it is empty"),
        ({"a.csv": "".join(f"{i},{i * i % 7}\n" for i in range(30))}, "no line of column names"),
        (
            {"a.csv": "v,w\n" + "".join(f"{i % 5},{i % 7}\n" for i in range(30))},
            r"a\.csv: no column looks like time.*'v', 'w'",
        ),
        (
            {"a.csv": "t,mode\n" + "".join(f"{i},7\n" for i in range(30))},
            r"no column besides 't' can be a channel \('mode': it never changes",
        ),
        ({"metadata.yaml": "x", "a.db3": "x"}, "is itself a ROS 2 bag"),
        ({"a.mcap": "x"}, r"a\.mcap is cut off or damaged"),
        ({"a.parquet": "x"}, r"a\.parquet: it cannot be read as Parquet"),
    ],
)
def test_where_nothing_can_be_proposed_a_sentence_says_why(folder, capsys, files, told):
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    for command in ("new-case", "inspect"):
        assert run(command, folder) == 1
        printed = capsys.readouterr()
        assert re.search(told, printed.err)
        assert "fault of the program" not in printed.err
        assert not printed.out


def test_a_file_or_a_missing_folder_is_named(folder, capsys):
    write_rovers(folder, files=1)
    assert run("new-case", folder / "Fahrt 0.csv") == 1
    assert "is a file; give the folder" in capsys.readouterr().err
    assert run("new-case", folder / "nowhere") == 1
    assert "there is no such folder" in capsys.readouterr().err


def test_many_files_are_all_checked_though_few_are_looked_at(folder, capsys):
    for seed in range(60):
        rover(seed, samples=150).to_csv(folder / f"{seed:03d}.csv", index=False)
    (folder / "031.csv").write_text("Zeit [s],v [m/s]\n0,1\n")
    assert run("new-case", folder, "--name", "rover") == 0
    error = capsys.readouterr().err
    assert "8 of 60 recordings were looked at" in error
    assert "error: 031.csv" in error


def test_splits_that_are_written_down_are_taken(folder, capsys):
    write_rovers(folder, files=5)
    parts = ("train", "train", "validation", "calibration", "test")
    rows = "".join(f"Fahrt {i},{part}\n" for i, part in enumerate(parts))
    (folder / "recordings.csv").write_text(f"recording,split\n{rows}")
    assert run("new-case", folder, "--name", "rover") == 0
    printed = capsys.readouterr()
    case = YAML(typ="safe").load(printed.out)["profiles"]["rover"]["cases"]["rover"]
    assert case["splits"]["kind"] == "metadata"
    assert case["faults"]["kinds"]
    assert "Quality check: no findings." in printed.err


def test_labels_stand_in_for_faults(folder, capsys):
    write_rovers(folder, files=12)
    (folder / "labels.csv").write_text("recording,start_s,end_s,label\nFahrt 0,40,80,slope\n")
    assert run("new-case", folder, "--name", "rover") == 0
    case = YAML(typ="safe").load(capsys.readouterr().out)["profiles"]["rover"]["cases"]["rover"]
    assert case["faults"] is None
    assert case["groups"]["overall"] == {}
