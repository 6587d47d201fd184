import pytest
from mlflow.tracking import MlflowClient

from odisar.config.loader import load_config
from odisar.tracking import Tracker, content_key, flatten, tracking_root, tracking_uri
from odisar.tracking.story import results_note, tell_story


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


def test_words_and_profiles_do_not_change_the_content(workspace):
    key = content_key(workspace)
    (workspace / "params.yaml").write_text("seed: 1  # why\nprofiles: {mine: {seed: 3}}\n")
    assert content_key(workspace) == key


def test_the_run_tells_what_it_is(workspace, request):
    root = request.config.rootpath
    story = tell_story(load_config(root), root)
    tracker = Tracker(workspace, "e", story)
    with tracker.stage("train") as run:
        run.dataset("vessel", "abc", "data/vessel", {"vessel-all": {"train": "44 recordings"}})
    stage, parent = (tracker.client.get_run(i) for i in (run.run_id, tracker.parent().run_id))
    assert parent.info.run_name.startswith("vessel-all + vessel-random + waypoint (")
    assert "| vessel-random | Ro-Ro ferry" in parent.data.tags["mlflow.note.content"]
    assert "maneuver: random" in parent.data.tags["mlflow.note.content"]
    assert parent.data.tags["cases"] == "vessel, robot"
    assert stage.data.tags["mlflow.note.content"] == "Train the twin of each set-up (DTM)"
    assert stage.inputs.dataset_inputs[0].dataset.name == "vessel"
    note = results_note(story, ["set-up", "AUROC %"], [["vessel-all", "96.4"]])
    assert "| set-up | AUROC % |\n| --- | --- |\n| vessel-all | 96.4 |" in note
