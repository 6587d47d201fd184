"""The runner refuses what can't be run in a sentence, and hands a part what it declared."""

import sys
from types import SimpleNamespace

import pytest

from odisar.config.loader import load_config
from odisar.errors import OdisarError
from odisar.study import runner
from odisar.study.runner import PARTS, run_part


@pytest.fixture(scope="module")
def config(request):
    """Return the shipped parameters, read once."""
    return load_config(request.config.rootpath)


@pytest.fixture
def workspace(tmp_path, monkeypatch, config):
    """Return a folder with the shipped parameters, in which nothing has been run."""
    monkeypatch.setattr(runner, "load_config", {tmp_path: config}.__getitem__)
    return tmp_path


@pytest.fixture
def runs(monkeypatch):
    """Return what the parts `seeds` (of a set-up) and `leakage` (of all) are called with."""
    calls = []

    def stand_in(name, params):
        run = lambda view, workspace, *setup: calls.append((name, view, workspace.root, setup))  # noqa: E731
        monkeypatch.setitem(
            sys.modules, f"odisar.study.{name}", SimpleNamespace(PARAMS=params, run=run)
        )

    stand_in("seeds", ("seed", "study"))
    stand_in("leakage", ("seed",))
    return calls


def test_an_unknown_part_is_refused_with_the_parts_there_are(workspace):
    with pytest.raises(OdisarError, match="no part 'everything'") as caught:
        run_part("everything", None, workspace)
    assert all(name in str(caught.value) for name in PARTS)


def test_a_set_up_that_is_not_the_studys_is_refused(workspace, runs):
    (workspace / "build/evaluate").mkdir(parents=True)
    with pytest.raises(OdisarError, match=r"'vessel-random' is not among study.setups: vessel-all"):
        run_part("seeds", "vessel-random", workspace)
    assert runs == []


def test_nothing_is_run_before_the_pipeline_was(workspace, runs):
    with pytest.raises(OdisarError, match=r"stands on the pipeline's results.*make repro"):
        run_part("leakage", None, workspace)
    assert runs == []


def test_a_part_gets_the_sections_it_declared_and_no_other(workspace, runs):
    (workspace / "build/evaluate").mkdir(parents=True)
    run_part("seeds", "waypoint", workspace)
    run_part("leakage", None, workspace)
    assert [(name, root, setup) for name, _, root, setup in runs] == [
        ("seeds", workspace, ("waypoint",)),
        ("leakage", workspace, ()),
    ]
    seeds, leakage = (view for _, view, _, _ in runs)
    assert "waypoint" in seeds.study.setups
    with pytest.raises(AttributeError, match="reads section 'study'"):
        _ = leakage.study
