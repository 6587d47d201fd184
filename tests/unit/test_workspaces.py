"""A profile is laid out as a project of its own, with its own case and recordings."""

import copy
import os
import shutil

import pytest
from ruamel.yaml import YAML

from odisar.config.loader import load_config
from odisar.errors import OdisarError
from odisar.workspaces import lay_out

yaml = YAML()


@pytest.fixture
def project(tmp_path, request):
    """A project with a profile ``mine`` whose recordings lie outside of it."""
    root = tmp_path / "project"
    root.mkdir()
    origin = request.config.rootpath
    for name in ("dvc.yaml", ".dvcignore", "params.yaml"):
        shutil.copyfile(origin / name, root / name)
    for name in ("src", "notebooks"):
        (root / name).mkdir()
    mine = tmp_path / "elsewhere"
    (mine / "deep").mkdir(parents=True)
    (mine / "a.csv").write_text("one")
    (mine / "deep/b.txt").write_text("two")
    add_profile(root, str(mine))
    return root


def add_profile(root, folder, **changes):
    params = yaml.load((root / "params.yaml").read_text())
    case = copy.deepcopy(params["cases"]["vessel"])
    case["source"] |= {"folder": folder, "maker": "none"}
    params["profiles"]["mine"] = {
        "pipeline": {"setups": ["mine"]},
        "setups": {"mine": {"case": "mine", "select": {}, "published_as": None}},
        "cases": {"mine": case},
        **changes,
    }
    with (root / "params.yaml").open("w") as file:
        yaml.dump(params, file)


def test_a_profile_brings_a_case_and_its_recordings(project):
    target = lay_out(project, "mine")
    config = load_config(target)
    assert config.active_cases == ["mine"]
    assert config.cases["mine"].source.folder == "data/mine"
    assert (target / "data/mine/a.csv").read_text() == "one"
    assert (target / "data/mine/deep/b.txt").read_text() == "two"
    assert "mine" not in load_config(project).cases


def test_recordings_follow_their_origin_and_those_unchanged_are_left_alone(project, tmp_path):
    target = lay_out(project, "mine")
    kept = (target / "data/mine/deep/b.txt").stat().st_ino
    (tmp_path / "elsewhere/a.csv").unlink()
    changed = tmp_path / "elsewhere/deep/c.csv"
    changed.write_text("three")
    lay_out(project, "mine")
    assert not (target / "data/mine/a.csv").exists()
    assert (target / "data/mine/deep/c.csv").read_text() == "three"
    assert (target / "data/mine/deep/b.txt").stat().st_ino == kept
    changed.write_text("four!")
    os.utime(changed, (1, 1))
    lay_out(project, "mine")
    assert (target / "data/mine/deep/c.csv").read_text() == "four!"


def test_a_folder_that_is_not_there_is_named(project):
    add_profile(project, "nowhere/at/all")
    with pytest.raises(OdisarError, match=r"cases\.mine\.source\.folder=nowhere/at/all: there is"):
        lay_out(project, "mine")


def test_a_profile_with_a_list_for_cases_is_refused(project):
    add_profile(project, "x", cases=["mine"])
    with pytest.raises(OdisarError, match=r"profiles\.mine\.cases: expected names"):
        lay_out(project, "mine")


def test_an_unknown_profile_is_named_with_those_there_are(project):
    with pytest.raises(OdisarError, match=r"'yours' is not declared in params\.yaml; declared"):
        lay_out(project, "yours")
