"""The whole pipeline on its small profile, in a copy of the project, twice and broken."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import jsonschema
import numpy as np
import pandas as pd
import pytest
from mlflow.tracking import MlflowClient

from odisar.artifacts import Workspace, read_json
from odisar.capability.assessment import assessment_schema
from odisar.capability.innovation_values import InnovationScoreValues
from odisar.capability.scoring import DETECTORS, Scorer
from odisar.config.loader import ConfigView, load_config
from odisar.recordings.schema import Recording
from odisar.recordings.store import read_store
from odisar.stages.runner import STAGES
from odisar.study import confirmation
from odisar.twin.bundle import read_twin
from odisar.windows.scaling import channel_std

ROOT = Path(__file__).resolve().parent.parent.parent
SETUPS = ("vessel-all", "waypoint")
CASES = {"vessel-all": "vessel", "waypoint": "robot"}
pytestmark = pytest.mark.slow


def command(cwd: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    source = "src" if (cwd / "src").exists() else str(ROOT / "src")
    environment = os.environ | {"PYTHONPATH": source}
    environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{environment['PATH']}"
    return subprocess.run(
        [sys.executable, "-m", *arguments],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the project in which the smoke profile has run."""
    copy = tmp_path_factory.mktemp("project")
    for name in ("src", "notebooks"):
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("params.yaml", "dvc.yaml", ".dvcignore"):
        shutil.copyfile(ROOT / name, copy / name)
    done = command(copy, "odisar", "profile", "smoke")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "AUROC" in done.stdout
    return copy


@pytest.fixture(scope="module")
def workspace(project: Path) -> Workspace:
    return Workspace(project / "workspaces/smoke")


@pytest.fixture
def client(project: Path) -> MlflowClient:
    return MlflowClient(f"sqlite:///{project / 'mlflow.db'}")


def all_runs(client: MlflowClient):
    return client.search_runs([item.experiment_id for item in client.search_experiments()])


def test_the_detection_table_is_tidy_and_complete(workspace):
    table = pd.read_csv(workspace.results / "detection.csv")
    wanted = "setup evaluated_on strength protocol detector metric value ci_low ci_high published"
    assert list(table.columns) == wanted.split()
    assert set(table.setup) == set(SETUPS)
    assert set(table.protocol) == {"P1", "P2", "P2-guarded", "proactive"}
    assert {"odisar", "rmse", "oracle"} <= set(table.detector)
    assert {"overall", "case-3", "zigzag", "random", "turning", "wind"} <= set(table.evaluated_on)
    assert {"auroc", "tnr_at_tpr95", "f1_ind", "f1_ood"} <= set(table.metric)
    assert {"false_alarms_per_hour", "events_detected", "delay_p50_s"} <= set(table.metric)
    key = ["setup", "evaluated_on", "strength", "protocol", "detector", "metric"]
    assert not table.duplicated(key).any()
    known = table.dropna(subset=["value", "ci_low", "ci_high"])
    assert (known.ci_low <= known.ci_high).all()


def test_the_oracle_of_the_monitors_protocol_is_perfect_and_that_of_the_papers_is_not(workspace):
    table = pd.read_csv(workspace.results / "detection.csv")
    oracle = table[(table.detector == "oracle") & (table.metric == "auroc")]
    assert (oracle[oracle.protocol == "P2"].value == 1).all()
    overall = oracle[oracle.evaluated_on == "overall"]
    assert (overall[overall.protocol == "P1"].value < 1).all()


@pytest.mark.parametrize("setup", SETUPS)
def test_every_assessment_fits_the_schema_and_every_test_recording_has_some(workspace, setup):
    rows = json.loads(workspace.assessments(setup).read_text())
    validator = jsonschema.Draft202012Validator(assessment_schema())
    assert not [row for row in rows if not validator.is_valid(row)]
    recordings = read_store(workspace.recordings(CASES[setup]))
    test = [recording for recording in recordings if recording.info.split == "test"]
    assert {row["recording"] for row in rows} == {recording.name for recording in test}


@pytest.mark.parametrize("setup", SETUPS)
def test_the_trained_twin_is_causal(workspace, setup):
    limits = read_json(workspace.thresholds(setup))["members"][setup]
    fitted = InnovationScoreValues.model_validate(limits["innovation"]).build()
    scorer = Scorer(read_twin(workspace.twin(setup)), 256, "cpu", fitted)
    recordings = read_store(workspace.recordings(CASES[setup]))
    recording = next(r for r in recordings if r.info.disturbance in ("case-3", "noise"))
    std = channel_std([recording])
    at = 500
    later, now = recording.values.copy(), recording.values.copy()
    later[at + 1 :] += 5 * std
    now[at] += std

    def scores(values: np.ndarray) -> dict[str, np.ndarray]:
        changed = Recording(recording.name, recording.info, recording.time_s, values)
        return dict(scorer.score(changed, short_lead_steps=10).scores)

    before, unmoved, moved = scores(recording.values), scores(later), scores(now)
    place = at - int(scorer.twin.spec.issue_positions((0, len(now)), 1)[0])
    for detector in DETECTORS:
        upto = slice(0, place + 1)
        np.testing.assert_array_equal(before[detector][upto], unmoved[detector][upto])
        assert abs(moved[detector][place] - before[detector][place]) > 1e-5


@pytest.mark.parametrize("setup", SETUPS)
def test_a_second_draw_is_scored_as_test_recordings_are(workspace, setup, monkeypatch):
    view = ConfigView(load_config(workspace.root), confirmation.PARAMS)
    test = [r for r in read_store(workspace.recordings(CASES[setup])) if r.info.split == "test"]
    monkeypatch.setattr(confirmation, "second_draw", lambda *_: iter(test))
    path = workspace.study_results / f"confirmation-{setup}.csv"
    confirmation.run(view, workspace, setup)
    table = pd.read_csv(path)
    path.unlink()  # a report takes in what there is of the study
    assert len(table) > 100
    assert set(table.protocol) == {"P2"}
    np.testing.assert_array_equal(table.value, table.on_test)


def test_one_finished_parent_holds_the_whole_result(client):
    parents = [run for run in all_runs(client) if "odisar.content" in run.data.tags]
    assert len(parents) == 1
    parent = parents[0]
    assert parent.info.status == "FINISHED"
    assert parent.data.params["twin.patch_steps"] == "5"
    assert any(name.endswith("auroc") for name in parent.data.metrics)
    assert {"git.revision", "data.hash"} <= set(parent.data.tags)
    paths = [item.path for item in client.list_artifacts(parent.info.run_id)]
    assert any("report" in path for path in paths)
    stages = [run.data.tags.get("DVC_STAGE") for run in all_runs(client)]
    named = sorted(stage for stage in stages if stage)
    assert named == sorted(STAGES)
    trials = [run for run in all_runs(client) if "trial.state" in run.data.tags]
    assert len(trials) == 2 * len(SETUPS)


def test_the_report_is_one_file_that_needs_no_network(workspace):
    page = workspace.report.read_text(encoding="utf-8")
    assert "data:image/png;base64," in page
    for marker in ('src="http', "src='http", 'rel="stylesheet"', "url(http", "@import"):
        assert marker not in page
    assert str(workspace.root) not in page


def test_a_second_run_does_nothing(project, workspace, client):
    runs = len(all_runs(client))
    lock = (workspace.root / "dvc.lock").read_bytes()
    done = command(project, "odisar", "profile", "smoke")
    assert done.returncode == 0, done.stderr
    assert "Running stage" not in done.stdout
    assert (workspace.root / "dvc.lock").read_bytes() == lock
    assert len(all_runs(client)) == runs


def test_a_forced_run_makes_the_same_bytes_and_no_second_parent(workspace, client, monkeypatch):
    monkeypatch.setenv("ODISAR_TRACKING_ROOT", str(workspace.root.parent.parent))
    runs = len(all_runs(client))
    lock = (workspace.root / "dvc.lock").read_bytes()
    done = command(workspace.root, "dvc", "repro", "--force")
    assert done.returncode == 0, done.stdout + done.stderr
    assert (workspace.root / "dvc.lock").read_bytes() == lock
    assert len(all_runs(client)) == runs


def test_a_bad_file_stops_the_run_with_a_table_and_marks_it_failed(workspace, client, monkeypatch):
    monkeypatch.setenv("ODISAR_TRACKING_ROOT", str(workspace.root.parent.parent))
    victim = next((workspace.root / "data/vessel").glob("train-zigzag-10*.csv"))
    good = victim.read_text()
    lines = good.splitlines(keepends=True)
    lines[41] = lines[41].replace(",", ",abc", 1)
    victim.write_text("".join(lines))
    try:
        done = command(workspace.root, "odisar", "stage", "preprocess")
    finally:
        victim.write_text(good)
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    for part in (victim.name, "42", "Rudder Angle", "abc"):
        assert part in done.stderr
    parents = [run for run in all_runs(client) if "odisar.content" in run.data.tags]
    assert [run.info.status for run in parents] == ["FAILED"]
