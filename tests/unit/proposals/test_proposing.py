"""What is proposed holds: it is read without an error, divided, and made faulty."""

import pytest

from odisar.config.loader import load_config
from odisar.errors import OdisarError
from odisar.proposals.new_case import propose, unsure_of
from odisar.recordings.faults import inject_faults
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
