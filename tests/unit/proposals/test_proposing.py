"""What is proposed holds: it is read without an error, divided, and made faulty."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from odisar.config.loader import load_config
from odisar.errors import OdisarError
from odisar.proposals.inspection import counts_of
from odisar.proposals.new_case import propose, unsure_of
from odisar.proposals.plans import Wishes
from odisar.proposals.summary import summary
from odisar.recordings.faults import inject_faults
from odisar.recordings.quality import Finding
from odisar.recordings.splits import PARTS, assign_splits
from odisar.windows.scaling import channel_std


def proposed(root, folder, name="mine"):
    return propose(root, folder, name, lambda _: None, write=False)


@pytest.mark.parametrize(
    ("files", "samples"), [(1, 700), (1, 6000), (3, 400), (9, 1500), (12, 300), (40, 900)]
)
def test_recordings_of_any_amount_can_be_divided_and_made_faulty(
    root, folder, write, files, samples
):
    write(files, samples=samples)
    case = (found := proposed(root, folder)).case
    assert not found.result.findings
    folds = range(case.splits.folds) if case.splits.folds else [None]
    for fold in folds:
        parts = assign_splits(found.result.recordings, case, {}, fold, 1)
        assert all(parts[part] for part in PARTS if part != "development")
        faulty = inject_faults(parts["test"], case, channel_std(parts["train"]), 1)
        assert {item.info.disturbance for item in faulty} == set(case.faults.kinds)


def test_a_recording_that_was_broken_off_is_an_error_and_shortens_nothing(root, folder, write):
    write(12, samples=1500)
    path = folder / "run 3.csv"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:14]))
    found = proposed(root, folder)
    assert found.case.window.context_steps >= 40
    errors = [item for item in found.result.findings if item.severity == "error"]
    assert [item.problem for item in errors] == ["the recording is shorter than one window"]


def test_limits_come_from_all_recordings_not_from_those_looked_at(root, folder, write):
    write(20)
    path = folder / "run 5.csv"
    lines = path.read_text().splitlines()
    lines[3] = lines[3].replace(lines[3].split(",")[2], "40.5")
    path.write_text("\n".join(lines) + "\n")
    case = proposed(root, folder).case
    speed = next(channel for channel in case.channels if channel.name == "speed [m/s]")
    assert speed.max >= 81


def test_columns_that_only_some_files_have_are_left_out_and_named(root, folder, write):
    write(4)
    path = folder / "run 1.csv"
    lines = path.read_text().splitlines()
    path.write_text("\n".join([f"{lines[0]},extra", *(f"{line},{i % 9}" for i, line in
                                                      enumerate(lines[1:]))]) + "\n")  # fmt: skip
    found = proposed(root, folder)
    assert found.case.channel_names == ["rudder_cmd", "speed [m/s]", "roll (deg)"]
    assert "column 'extra' is only in 'run 1.csv': left out" in found.remarks


def test_a_folder_of_the_project_is_declared_from_its_root(root, folder, write):
    write(3)
    inside = root / "data/mine"
    inside.parent.mkdir()
    folder.rename(inside)
    assert proposed(root, inside).case.source.folder == "data/mine"


@pytest.mark.parametrize(
    ("name", "slug"),
    [("My Runs", "my-runs"), ("2024", "case-2024"), ("no", "case-no"), ("données", "donn-es"),
     ("данные", "case-own"), ("y", "case-y")],
)  # fmt: skip
def test_a_case_is_called_after_its_folder(root, folder, write, name, slug):
    write(2)
    renamed = folder.with_name(name)
    folder.rename(renamed)
    assert proposed(root, renamed, name=None).name == slug


def test_a_name_that_yaml_takes_for_a_number_is_one_all_the_same(root, folder, write):
    write(2)
    assert proposed(root, folder, name="7").case.title == "my runs"


def test_a_name_that_cannot_name_a_folder_is_refused(root, folder):
    with pytest.raises(OdisarError, match=r"--name 'a/b': use letters"):
        proposed(root, folder, name="a/b")


def test_doubts_are_listed_by_key_and_guessed_limits_together():
    text = (
        "rate_hz: 5.0  # ? measured 5.1 Hz\n"
        '- {name: "v [m/s]", unit: "1"}  # ? unit unknown; limits: seen 1 to 2\n'
        "- {name: w, unit: m}  # ? limits: seen 1 to 2\n"
        "folds: 6  # a note\n"
    )
    assert unsure_of(text) == [
        "rate_hz: measured 5.1 Hz",
        "v [m/s]: unit unknown",
        "min and max, guessed from what was seen, of v [m/s], w",
    ]


def test_nothing_of_a_proposal_changes_the_project(root, folder, write):
    write(3)
    before = (root / "params.yaml").read_bytes()
    proposed(root, folder)
    assert (root / "params.yaml").read_bytes() == before
    assert "mine" not in load_config(root).cases


def test_columns_of_text_are_named_in_every_file_and_never_advised(root, folder, write):
    write(20)
    for name, column in (("run 0.csv", "mode"), ("run 5.csv", "remark")):
        lines = (folder / name).read_text().splitlines()
        rows = [f"{lines[0]},{column}", *(f"{line},calm" for line in lines[1:])]
        (folder / name).write_text("\n".join(rows) + "\n")
    found = proposed(root, folder)
    for column in ("mode", "remark"):
        assert f"{column} (text: cannot be a channel)" in found.text
    assert not [item for item in found.result.findings if item.remedy.startswith("add")]
    assert "add it" not in summary(found, folder, written=False)


def test_rate_and_window_can_be_chosen_and_all_lengths_follow(root, folder, write):
    write(12, samples=1500)
    usual = proposed(root, folder).case
    wishes = Wishes(rate_hz=2.5, context_s=20.0, horizon_s=8.0)
    case = propose(root, folder, "mine", lambda _: None, write=False, wishes=wishes).case
    assert (case.rate_hz, case.source.resample) == (2.5, "hold")
    assert (case.window.context_steps, case.window.horizon_steps) == (50, 20)
    assert case.guard_end_s == 20.0
    assert case.short_lead_s == pytest.approx(1.6)
    assert case.persistence_s < usual.persistence_s * 2.5
    assert case.faults.start_s >= 20.0


@pytest.mark.parametrize(
    ("wishes", "told"),
    [
        (Wishes(rate_hz=50.0), "--rate-hz 50: samples come at 5 Hz"),
        (Wishes(horizon_s=-1.0), "--horizon-s -1: give a number above 0"),
    ],
)
def test_a_wish_that_cannot_be_met_is_refused(root, folder, write, wishes, told):
    write(3)
    with pytest.raises(OdisarError, match=re.escape(told)):
        propose(root, folder, "mine", lambda _: None, write=False, wishes=wishes)


@pytest.mark.parametrize(("files", "samples"), [(1, 6000), (12, 900)])
@pytest.mark.parametrize("rate_hz", [8.0, 50.0])
def test_a_jittered_pose_is_thinned_into_lengths_that_fit(root, folder, files, samples, rate_hz):
    for seed in range(files):
        random = np.random.default_rng(seed)
        yaw = np.cumsum(random.normal(0, 0.05, samples))
        at = np.sort(np.arange(samples) / rate_hz + random.uniform(0, 0.8 / rate_hz, samples))
        columns = {"time_s": at, "x": np.cumsum(np.cos(yaw)), "y": np.cumsum(np.sin(yaw)),
                   "yaw_rad": yaw, "speed": 1 + 0.1 * random.normal(size=samples)}  # fmt: skip
        pd.DataFrame(columns).to_csv(folder / f"run {seed}.csv", index=False)
    case = (found := proposed(root, folder)).case
    assert case.source.resample == "thin"
    assert not [item for item in found.result.findings if item.severity == "error"]
    assert len(found.result.recordings) == files
    for fold in range(case.splits.folds) if case.splits.folds else [None]:
        parts = assign_splits(found.result.recordings, case, {}, fold, 1)
        assert all(parts[part] for part in PARTS if part != "development")
        faulty = inject_faults(parts["test"], case, channel_std(parts["train"]), 1)
        assert {item.info.disturbance for item in faulty} == set(case.faults.kinds)


def test_what_lies_beside_the_recordings_is_named_without_terminal_escapes(root, folder, write):
    write(3)
    (folder / "x\x1b[31m.xlsx").write_text("")
    (folder / "notes.txt").write_text("")
    text = summary(proposed(root, folder), folder, written=False)
    assert "'notes.txt', 'x?[31m.xlsx': not a CSV or Parquet file" in text
    assert "\x1b" not in text


def test_counts_tell_places_and_kinds_apart():
    missing = Finding("error", "a.csv", "v", 3, "", "the value is missing", "write it")
    rest = replace(missing, row=None, value="and 397 more")
    other = replace(missing, column="w")
    warning = replace(missing, severity="warning")
    assert counts_of([missing, rest, other, warning]) == "399 errors of 2 kinds, 1 warning"
    assert counts_of([]) == "0 errors, 0 warnings"
