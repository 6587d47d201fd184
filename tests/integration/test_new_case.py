"""A stranger's recordings become a profile that can be run, and what is wrong with them is said."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from ruamel.yaml import YAML

from odisar.cli import main
from odisar.config.loader import load_config
from odisar.recordings.reader import read_case
from odisar.workspaces import lay_out

ROOT = Path(__file__).resolve().parent.parent.parent
pytestmark = pytest.mark.usefixtures("root")


@pytest.fixture
def root(tmp_path, monkeypatch):
    """A project that a command can run in and that a profile can be laid out from."""
    project = tmp_path / "project"
    project.mkdir()
    for name in ("params.yaml", "dvc.yaml", ".dvcignore"):
        shutil.copyfile(ROOT / name, project / name)
    for name in ("src", "notebooks"):
        (project / name).mkdir()
    monkeypatch.chdir(project)
    return project


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "Prüffahrten 2024"
    path.mkdir()
    return path


def rover(seed, samples=700, rate_hz=4.0):
    """A rover that turns as it is steered, logged by someone with other habits."""
    random = np.random.default_rng(seed)
    command = np.repeat(random.uniform(-30, 30, samples // 24 + 1), 24)[:samples]
    turn = np.convolve(command, np.exp(-np.arange(20) / 4) / 4)[:samples]
    return pd.DataFrame(
        {
            "Nr": np.arange(samples),
            "Zeit [s]": np.arange(samples) / rate_hz,
            "Lenkwinkel Soll [°]": command,
            "v [m/s]": 1.5 - abs(turn) / 80 + 0.02 * random.normal(size=samples),
            "yaw rate [deg/s]": turn + 0.5 * random.normal(size=samples),
            "mode": "AUTO",
        }
    )


def write_rovers(folder, files=12, **options):
    for seed in range(files):
        rover(seed).to_csv(
            folder / f"Fahrt {seed}.csv", sep=";", decimal=",", index=False, **options
        )


def run(*arguments):
    return main([str(argument) for argument in arguments])


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


STORE = get_typestore(Stores.ROS2_HUMBLE)


def write_bag(path, seed, seconds=60.0, unstamped=0):
    """Write odometry at 50 Hz and an inertial sensor at 100 Hz, as a robot's recorder does."""
    kinds = STORE.types
    vector, point = kinds["geometry_msgs/msg/Vector3"], kinds["geometry_msgs/msg/Point"]
    random = np.random.default_rng(seed)
    yaw = x = y = turn = 0.0

    def header(nanoseconds):
        stamp = kinds["builtin_interfaces/msg/Time"](
            sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9
        )
        return kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="base")

    def around(z):
        return vector(*(float(0.01 * value) for value in random.normal(size=2)), z=z)

    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        odometry = writer.add_connection("/odom", "nav_msgs/msg/Odometry", typestore=STORE)
        imu = writer.add_connection("/imu/data", "sensor_msgs/msg/Imu", typestore=STORE)
        for i in range(round(100 * seconds)):
            at = 1_700_000_000_000_000_000 + i * 10_000_000
            turn = 0.98 * turn + 0.05 * random.normal()
            yaw, x, y = yaw + turn / 100, x + np.cos(yaw) / 200, y + np.sin(yaw) / 200
            facing = kinds["geometry_msgs/msg/Quaternion"](
                x=0.0, y=0.0, z=float(np.sin(yaw / 2)), w=float(np.cos(yaw / 2))
            )
            stamp = 0 if i < unstamped else at
            measured = kinds["sensor_msgs/msg/Imu"](
                header(stamp),
                facing,
                np.zeros(9),
                around(turn),
                np.zeros(9),
                around(9.8),
                np.zeros(9),
            )
            raw = STORE.serialize_cdr(measured, "sensor_msgs/msg/Imu")
            writer.write(imu, at, raw)
            if i % 2:
                continue
            pose = kinds["geometry_msgs/msg/Pose"](point(float(x), float(y), 0.0), facing)
            twist = kinds["geometry_msgs/msg/Twist"](around(0.0), around(turn))
            moved = kinds["nav_msgs/msg/Odometry"](
                header(at),
                "base",
                kinds["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)),
                kinds["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36)),
            )
            writer.write(odometry, at, STORE.serialize_cdr(moved, "nav_msgs/msg/Odometry"))


def test_every_bag_of_a_folder_of_bad_ones_is_told(folder, capsys):
    for name in "abcd":
        (folder / f"{name}.mcap").write_text("x" if name != "c" else "")
    assert run("new-case", folder) == 1
    error = capsys.readouterr().err
    assert "none of the 4 recordings can be read" in error
    for name in "abd":
        assert re.search(rf"^{name}\.mcap +{name}\.mcap is cut off or damaged", error, re.MULTILINE)
    assert re.search(r"^c\.mcap +the file is empty +record it again", error, re.MULTILINE)


def test_bags_are_read_by_their_odometry(root, folder, capsys):
    for seed in range(2):
        write_bag(folder / f"run_{seed}", seed)
    assert run("new-case", folder, "--name", "base", "--write") == 0
    assert "2 recordings, 2 of them sound" in capsys.readouterr().err
    case = load_config(lay_out(root, "base")).cases["base"]
    bag = case.source.bag
    assert (bag.stamp_topic, bag.stamp) == ("/odom", "header")
    assert bag.fields["position_x"] == "/odom:pose.pose.position.x"
    assert bag.fields["linear_acceleration_x"] == "/imu/data:linear_acceleration.x"
    assert "position_z" not in bag.fields
    assert (case.rate_hz, case.source.resample) == (10.0, "thin")
    assert case.pose.heading == ["orientation_z", "orientation_w"]
    units = {channel.name: channel.unit for channel in case.channels}
    assert units["angular_velocity_z"] == "rad/s"
    assert units["position_x"] == "m"


def test_some_headers_without_a_stamp_make_the_time_of_receipt_the_clock(root, folder, capsys):
    write_bag(folder / "run_0", 0, unstamped=3)
    assert run("new-case", folder, "--name", "base", "--write") == 0
    printed = capsys.readouterr()
    assert "the header's stamp is 0 in messages of /imu/data" in printed.out
    assert "1 recording, 1 of them sound" in printed.err
    assert load_config(lay_out(root, "base")).cases["base"].source.bag.stamp == "received"


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


def test_inspect_finds_the_profile_by_its_folder_and_names_every_error(folder, capsys):
    write_rovers(folder, files=4)
    assert run("new-case", folder, "--name", "rover", "--write") == 0
    capsys.readouterr()
    assert run("inspect", folder) == 0
    text = capsys.readouterr().out
    assert "read as profile rover says" in text
    assert "4 of 4 recordings can be used" in text
    assert re.search(r"v \[m/s\] +m/s +forecast", text)
    lines = (folder / "Fahrt 1.csv").read_text().splitlines(keepends=True)
    lines[6] = lines[6].replace(lines[6].split(";")[3], "")
    (folder / "Fahrt 1.csv").write_text("".join(lines))
    (folder / "Fahrt 2.csv").write_bytes(b"")
    (folder / "lost.csv").symlink_to("/nowhere")
    (folder / "folder.csv").mkdir()
    assert run("inspect", folder, "--profile", "rover") == 1
    text = capsys.readouterr().out
    assert re.search(r"error +Fahrt 1\.csv +7 +v \[m/s\] +the value is missing", text)
    assert re.search(r"error +Fahrt 2\.csv +the file is empty", text)
    assert "a folder has the name" in text
    assert "2 of 6 recordings can be used" in text
    assert max(map(len, text.splitlines())) <= 120


def test_inspect_without_a_case_takes_what_would_be_proposed(folder, capsys):
    write_rovers(folder, files=4)
    assert run("inspect", folder) == 0
    assert "`odisar new-case` would propose" in capsys.readouterr().out


def test_inspect_as_a_case_that_does_not_fit_says_what_is_missing(folder, capsys):
    write_rovers(folder, files=1)
    assert run("inspect", folder, "--case", "gunnerus") == 1
    assert "the column is missing" in capsys.readouterr().out
    assert run("inspect", folder, "--case", "mine") == 1
    assert "case 'mine' is not declared" in capsys.readouterr().err


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
