import pytest
from mlflow.tracking import MlflowClient

from odisar.tracking import Tracker, content_key, flatten, tracking_root, tracking_uri


@pytest.fixture
def workspace(tmp_path, monkeypatch):
    monkeypatch.delenv("ODISAR_TRACKING_ROOT", raising=False)
    (tmp_path / "src").mkdir()
    (tmp_path / "src/a.py").write_text("x = 1\n")
    (tmp_path / "params.yaml").write_text("seed: 1\n")
    (tmp_path / "dvc.yaml").write_text("stages: {}\n")
    return tmp_path


def runs(tracker: Tracker):
    client: MlflowClient = tracker.client
    experiments = [item.experiment_id for item in client.search_experiments()]
    return client.search_runs(experiments)


def test_stages_of_one_content_share_one_parent(workspace):
    for name in ("train", "evaluate"):
        with Tracker(workspace, "e").stage(name) as run:
            run.metrics({"loss": 1.0})
    parents = [run for run in runs(Tracker(workspace, "e")) if "odisar.content" in run.data.tags]
    assert len(parents) == 1
    assert len(runs(Tracker(workspace, "e"))) == 3


def test_a_repeated_stage_replaces_its_run_and_trials(workspace):
    for _ in range(2):
        with Tracker(workspace, "e").stage("tune") as run, run.child("trial 0", {}) as trial:
            trial.params({"twin.layers": 2})
    assert len(runs(Tracker(workspace, "e"))) == 3


def test_changed_parameters_open_another_parent(workspace):
    first = Tracker(workspace, "e").parent().run_id
    key = content_key(workspace)
    (workspace / "params.yaml").write_text("seed: 2\n")
    assert content_key(workspace) != key
    assert Tracker(workspace, "e").parent().run_id != first


def test_a_stage_that_fails_marks_itself_and_the_parent(workspace):
    tracker = Tracker(workspace, "e")
    with pytest.raises(ValueError, match="broken"), tracker.stage("train"):
        raise ValueError("broken")
    assert {run.info.status for run in runs(tracker)} == {"FAILED"}
    with tracker.stage("train"):
        pass
    tracker.finish()
    assert {run.info.status for run in runs(tracker)} == {"FINISHED"}


def test_a_queued_copy_logs_to_the_repository(tmp_path, monkeypatch):
    monkeypatch.delenv("ODISAR_TRACKING_ROOT", raising=False)
    copy = tmp_path / ".dvc/tmp/exps/tmpx1"
    copy.mkdir(parents=True)
    assert tracking_root(copy) == tmp_path
    assert tracking_uri(copy) == tracking_uri(tmp_path)


def test_nested_parameters_get_dotted_names():
    assert flatten({"a": {"b": 1, "c": {"d": 2}}, "e": 3}) == {"a.b": 1, "a.c.d": 2, "e": 3}
