"""What was finished is found again as long as nothing has changed that decides it."""

from pathlib import Path

import pytest

from odisar.artifacts import Workspace
from odisar.study import places
from odisar.study.places import alternatives_folder, study_folder


@pytest.fixture(autouse=True)
def source(tmp_path, monkeypatch):
    """Return a small source tree that stands for the project's."""
    root = tmp_path / "odisar"
    for name in ("study/places.py", "twin/network.py", "report/page.py"):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text("A = 1\n")
    monkeypatch.setattr(places, "__file__", str(root / "study/places.py"))
    return root


@pytest.fixture
def workspace(tmp_path):
    """Return a workspace with parameters and the checksums of its data."""
    root = tmp_path / "workspace"
    root.mkdir()
    (root / "params.yaml").write_text("seed: 1\nprofiles:\n  smoke: {seed: 2}\n")
    (root / "data.dvc").write_text("outs: [{md5: abc}]\n")
    return Workspace(root)


def test_the_folder_is_one_of_the_study_and_the_same_when_asked_again(workspace):
    folder = study_folder(workspace)
    assert folder.parent == workspace.study
    assert folder == study_folder(workspace)
    assert alternatives_folder(workspace, "boat") == folder / "alternatives/boat"


def test_a_parameter_changes_it_but_no_profile_does(workspace):
    params, before = workspace.root / "params.yaml", study_folder(workspace)
    params.write_text("# A comment.\nseed: 1\nprofiles: {}\n")
    assert study_folder(workspace) == before
    params.write_text("seed: 2\nprofiles:\n  smoke: {seed: 2}\n")
    assert study_folder(workspace) != before


def test_other_recordings_change_it(workspace):
    before = study_folder(workspace)
    (workspace.root / "data.dvc").write_text("outs: [{md5: abd}]\n")
    other = study_folder(workspace)
    (workspace.root / "data.dvc").unlink()
    assert len({before, other, study_folder(workspace)}) == 3


def test_code_that_decides_what_is_scored_changes_it_and_no_other(workspace, source):
    before = study_folder(workspace)
    (source / "report/page.py").write_text("A = 2\n")
    assert study_folder(workspace) == before
    (source / "twin/network.py").write_text("A = 2\n")
    assert study_folder(workspace) != before


def test_a_module_that_decides_changes_it_too(workspace, source):
    before = study_folder(workspace)
    (source / "fitting.py").write_text("A = 2\n")
    assert study_folder(workspace) != before


def test_what_decides_is_a_package_or_a_module(request):
    root = Path(request.config.rootpath) / "src/odisar"
    ends = [name if name.endswith(".py") else f"{name}/__init__.py" for name in places._DECISIVE]
    assert [end for end in ends if not (root / end).is_file()] == []
