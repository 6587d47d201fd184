import importlib
import shutil

import pytest
from mlflow.tracking import MlflowClient

from odisar.errors import OdisarError
from odisar.stages import preprocess, runner
from odisar.stages.runner import STAGES, run_stage
from odisar.study import runner as study


@pytest.fixture
def workspace(tmp_path, request, monkeypatch):
    """Parameters, pipeline and a line of code, without any recording."""
    monkeypatch.delenv("ODISAR_TRACKING_ROOT", raising=False)
    for name in ("params.yaml", "dvc.yaml"):
        shutil.copyfile(request.config.rootpath / name, tmp_path / name)
    (tmp_path / "src").mkdir()
    (tmp_path / "src/code.py").write_text("x = 1\n")
    return tmp_path


def runs(workspace):
    client = MlflowClient(f"sqlite:///{workspace / 'mlflow.db'}")
    found = client.search_runs([item.experiment_id for item in client.search_experiments()])
    return {item.data.tags.get("DVC_STAGE", "parent"): item for item in found}


def test_a_stage_without_recordings_fails_with_its_parent(workspace):
    with pytest.raises(OdisarError, match="'vessel'"):
        run_stage("preprocess", workspace)
    assert {name: run.info.status for name, run in runs(workspace).items()} == {
        "parent": "FAILED",
        "preprocess": "FAILED",
    }


def test_bad_parameters_stop_before_anything_is_tracked(workspace):
    path = workspace / "params.yaml"
    path.write_text(path.read_text().replace("  dropout: 0.1", "  dropout: 1.1", 1))
    with pytest.raises(OdisarError, match=r"twin\.dropout"):
        run_stage("preprocess", workspace)
    assert not (workspace / "mlflow.db").exists()


def test_a_stage_sees_and_logs_the_sections_it_declares_and_no_other(workspace, monkeypatch):
    seen = []

    def run(config, _workspace, _tracked):
        seen.append(config.seed)
        seen.append(config.training)

    monkeypatch.setattr(preprocess, "run", run)
    with pytest.raises(AttributeError, match=r"'training'.*declares only seed, pipeline"):
        run_stage("preprocess", workspace)
    assert seen == [20251122]
    logged = runs(workspace)["preprocess"].data.params
    assert logged["pipeline.workers"] == "2"
    assert not any(name.startswith("training.") for name in logged)


def test_processes_are_prepared_for_what_runs_some():
    for package, names, prepared in (
        ("stages", STAGES, runner._OF_MEMBERS),
        ("study", study.PARTS, study._SIDE_BY_SIDE),
    ):
        modules = {name: importlib.import_module(f"odisar.{package}.{name}") for name in names}
        assert {n for n, module in modules.items() if hasattr(module, "run_jobs")} == set(prepared)
