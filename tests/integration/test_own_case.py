"""A user's own machine, of another shape than the two shipped cases, through the whole pipeline."""

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
from ruamel.yaml import YAML

from odisar.artifacts import Workspace
from odisar.capability.assessment import assessment_schema
from small_system import SCORE

ROOT = Path(__file__).resolve().parent.parent.parent
TITLE = "Rover in a quarry"
RATE_HZ, SAMPLES = 4.0, 700
KINDS = ("noise", "bias", "drift", "stuck", "delay")
STATES = ("v [m/s]", "yaw rate [deg/s]")
pytestmark = pytest.mark.slow


def channel(name: str, unit: str, role: str, limit: float, *, output: bool) -> dict[str, object]:
    return {
        "name": name,
        "unit": unit,
        "role": role,
        "output": output,
        "known_ahead": False,
        "min": -limit,
        "max": limit,
    }


ROVER = {
    "title": TITLE,
    "source": {
        "folder": "data/rover",
        "maker": "none",
        "time_column": "Time (s)",
        "max_recordings": 10,
        "csv": {"separator": "comma", "decimal": "point"},
        "bag": None,
        "resample": "none",
    },
    "pose": None,
    "rate_hz": RATE_HZ,
    "max_gap_s": 0.4,
    "channels": [
        channel("steering command", "deg", "command", 40, output=False),
        channel("v [m/s]", "m/s", "state", 5, output=True),
        channel("yaw rate [deg/s]", "deg/s", "state", 90, output=True),
        channel("motor current, left", "A", "state", 50, output=False),
    ],
    "window": {"context_steps": 40, "horizon_steps": 20},
    "splits": {
        "kind": "cross-fit",
        "fractions": None,
        "folds": 4,
        "block_s": 50.0,
        "block_gap_s": 10.0,
    },
    "score": SCORE,
    "persistence_s": 1.0,
    "short_lead_s": 1.0,
    "guard_start_s": 2.0,
    "guard_end_s": 5.0,
    "groups": {
        "overall": {"disturbance": list(KINDS), "fault_shows": ["shows"]},
        "group_by": ["disturbance", "fault_channel"],
        "apart": ["fault_shows"],
        "with_clean": [],
    },
    "faults": {
        "kinds": list(KINDS),
        "channels": list(STATES),
        "sizes": {kind: [2.0] for kind in ("noise", "bias", "drift")},
        "sizes_in": "sd",
        "delays_s": [1.5],
        "creep": None,
        "start_s": 20.0,
        "duration_s": {"low": 12.0, "high": 12.0},
        "shows_from_sd": 0.25,
    },
    "range_rules": [{"name": "crawl rule", "channel": "v [m/s]", "min": 0.5, "max": 2.0}],
}


def drive(seed: int, samples: int) -> pd.DataFrame:
    """Return a rover that is steered now left, now right, and slows down where it turns."""
    random = np.random.default_rng(seed)
    command = np.repeat(random.uniform(-30, 30, samples // 24 + 1), 24)[:samples]
    speed, turn = np.empty(samples), np.empty(samples)
    speed[0], turn[0] = 1.5, 0.0
    for i in range(1, samples):
        turn[i] = 0.8 * turn[i - 1] + 0.2 * command[i - 1] * speed[i - 1]
        speed[i] = 0.9 * speed[i - 1] + 0.1 * (1.6 - abs(turn[i - 1]) / 80)
    noise = random.normal(size=(3, samples))
    columns = [
        np.arange(samples) / RATE_HZ,
        command,
        speed + 0.02 * noise[0],
        turn + 0.5 * noise[1],
        2 + 3 * speed + 0.1 * noise[2],
    ]
    names = [ROVER["source"]["time_column"], *(item["name"] for item in ROVER["channels"])]
    return pd.DataFrame(dict(zip(names, columns, strict=True)))


def change_parameters(path: Path) -> None:
    yaml = YAML()
    yaml.width = 1000
    params = yaml.load(path.read_text(encoding="utf-8"))
    params["cases"]["rover"] = ROVER
    params["setups"]["rover"] = {"case": "rover", "select": {}, "published_as": None}
    params["pipeline"] |= {"setups": ["rover"], "workers": 1, "accelerator": "cpu"}
    params["training"] |= {"epochs": 1, "steps_per_epoch": 10, "learning_rate": 1.0e-3}
    params["tuning"] |= {"trials": 2, "steps_per_trial": 8, "reports_per_trial": 2}
    params["monte_carlo"]["draws"] = 3
    params["evaluation"]["bootstrap_draws"] = 50
    with path.open("w", encoding="utf-8") as file:
        yaml.dump(params, file)


def run(cwd: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": "src"}
    environment.pop("ODISAR_TRACKING_ROOT", None)
    environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{environment['PATH']}"
    done = subprocess.run(
        [sys.executable, "-m", *arguments],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """Return a copy of the project that has run the rover alone."""
    copy = tmp_path_factory.mktemp("rover")
    for name in ("src", "notebooks"):
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("params.yaml", "dvc.yaml", ".dvcignore"):
        shutil.copyfile(ROOT / name, copy / name)
    change_parameters(copy / "params.yaml")
    folder = copy / ROVER["source"]["folder"]
    folder.mkdir(parents=True)
    for seed in range(3):
        drive(seed, samples=SAMPLES).to_csv(folder / f"day {seed}.csv", index=False)
    run(copy, "dvc", "init", "--no-scm", "-q")
    run(copy, "dvc", "config", "core.analytics", "false")
    assert "AUROC" in run(copy, "odisar", "repro").stdout
    return Workspace(copy)


def test_every_kind_of_fault_is_judged_by_every_detector(workspace):
    table = pd.read_csv(workspace.results / "detection.csv")
    assert set(table.setup) == {"rover"}
    auroc = table[(table.protocol == "P2") & (table.metric == "auroc")]
    judged = set(zip(auroc.evaluated_on, auroc.detector, strict=True))
    detectors = ("odisar", "rmse", "rmse-short-lead", "crawl rule")
    assert {(kind, detector) for kind in KINDS for detector in detectors} <= judged
    assert {"overall", *STATES} <= set(auroc.evaluated_on)
    assert auroc.value.between(0, 1).all()


def test_every_block_is_tested_once_and_the_splits_say_so(workspace):
    splits = pd.read_csv(workspace.preprocess / "splits.csv")
    test = splits[splits.split == "test"]
    blocks = 3 * 3  # of 50 s, 10 s apart, in three recordings of 175 s
    faults = len(KINDS) * len(STATES)
    assert sorted(test.fold) == [0, 1, 2, 3]
    assert test.recordings.sum() == blocks * (1 + faults)
    assert test.disturbed.sum() == blocks * faults


def test_the_assessments_fit_the_schema_in_the_units_of_a_4_hz_recording(workspace):
    rows = json.loads(workspace.assessments("rover").read_text(encoding="utf-8"))
    validator = jsonschema.Draft202012Validator(assessment_schema())
    assert not [row for row in rows if not validator.is_valid(row)]
    horizon = ROVER["window"]["horizon_steps"]
    first = rows[0]
    assert first["end_s"] - first["issued_s"] == pytest.approx(horizon / RATE_HZ)
    rebuilt = {state for row in rows for state in row["reconstruction_attribution"]}
    assert rebuilt <= set(STATES)
    # A state that isn't forecast over the horizon can be to blame for an innovation too.
    blamed = {state for row in rows for state in row["state_attribution"]}
    assert blamed <= {*STATES, "motor current, left"}


def test_the_report_is_about_this_case(workspace):
    page = workspace.report.read_text(encoding="utf-8")
    assert TITLE in page
    for state in STATES:
        assert state in page


def test_there_is_one_finished_parent_run(workspace):
    client = MlflowClient(f"sqlite:///{workspace.root / 'mlflow.db'}")
    runs = client.search_runs([item.experiment_id for item in client.search_experiments()])
    parents = [item for item in runs if "odisar.content" in item.data.tags]
    assert [item.info.status for item in parents] == ["FINISHED"]
    assert {item.info.status for item in runs} == {"FINISHED"}
