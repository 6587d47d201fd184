"""Reports and models are asked for where there are some, and nothing is started or made there."""

import pytest

from odisar.errors import OdisarError
from odisar.reproduce import rebuild_report, workspace_of
from odisar.tracking.registry import load_model, model_name, promote


@pytest.mark.parametrize(
    ("profile", "command"), [(None, "make repro"), ("mine", "odisar profile mine")]
)
def test_a_report_of_nothing_starts_no_training(tmp_path, profile, command):
    with pytest.raises(OdisarError, match=f"nothing has been evaluated yet; run `{command}`"):
        rebuild_report(tmp_path, profile)
    assert list(tmp_path.iterdir()) == []


def test_a_profiles_results_are_in_its_workspace(tmp_path):
    (tmp_path / "workspaces/mine/build/evaluate").mkdir(parents=True)
    assert workspace_of(tmp_path, "mine") == tmp_path / "workspaces/mine"


def test_asking_for_a_model_makes_no_store(tmp_path, monkeypatch):
    monkeypatch.delenv("ODISAR_TRACKING_ROOT", raising=False)
    with pytest.raises(OdisarError, match="no MLflow store"):
        load_model(tmp_path, "odisar.waypoint", "champion")
    with pytest.raises(OdisarError, match="no MLflow store"):
        promote(tmp_path, "odisar.waypoint", "1")
    assert list(tmp_path.iterdir()) == []


def test_a_models_name_is_its_experiment_and_its_set_up():
    assert model_name("odisar mine/1", "boat") == "odisar-mine-1.boat"
