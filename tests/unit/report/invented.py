"""A workspace of small, invented results: enough for tables, sentences and figures."""

import json
from pathlib import Path

import numpy as np
import pandas as pd

from odisar.artifacts import Workspace, write_json, write_table
from odisar.report.load import report_folder

from .invented_comparisons import forecast_rows, leakage_rows, paired_rows, rule_rows
from .invented_tables import (
    DEPLOYED,
    SETUPS,
    STATES,
    attribution_rows,
    blame_rows,
    detection_rows,
    quadrant_rows,
    reliability_curve_rows,
    reliability_rows,
)

ROOT = Path(__file__).parents[3]
DISTURBED, CLEAN = "test-turning-20-case-3-s1", "test-turning-20-clean-1"
EVENT = [420.0, 840.0]


def write_results(workspace: Workspace) -> None:
    operating = pd.DataFrame(
        [
            (setup, name, 20, 1000, 8.0, 4, 0.5, 0.2, 0.9, 10, 8)
            for setup in SETUPS
            for name in DEPLOYED
        ],
        columns=[
            "setup",
            "detector",
            "recordings",
            "windows",
            "hours",
            "false_alarms",
            "false_alarms_per_hour",
            "ci_low",
            "ci_high",
            "events",
            "events_detected",
        ],
    )
    nearness = pd.DataFrame(
        [(setup, "test", 100, 0.2, 0.2, 0.3, 0.6) for setup in SETUPS],
        columns=["member", "split", "windows", "smallest", "quantile_01", "median", "quantile_99"],
    )
    tables = {
        "detection": detection_rows(),
        "operating": operating,
        "paired": paired_rows(),
        "thresholds": rule_rows(),
        "quadrants": quadrant_rows(),
        "attribution": attribution_rows(),
        "blame": blame_rows(),
        "reliability": reliability_rows(),
        "reliability-curves": reliability_curve_rows(),
        "forecast": forecast_rows(),
        "leakage": leakage_rows(),
        "nearness": nearness,
    }
    for name, table in tables.items():
        write_table(workspace.results / f"{name}.csv", table)


def write_artefacts(workspace: Workspace) -> None:
    splits = pd.DataFrame(
        [(setup, np.nan, split, 5, 0, 2.0, 100) for setup in SETUPS for split in ("train", "test")],
        columns=["setup", "fold", "split", "recordings", "disturbed", "hours", "windows"],
    )
    write_table(workspace.preprocess / "splits.csv", splits)
    quality = pd.DataFrame(
        [("a.csv", 1200, 1199.0, 1, 0, 0, 1, "a value <b>", "vessel")],
        columns=[
            "file",
            "samples",
            "seconds",
            "segments",
            "gaps",
            "errors",
            "warnings",
            "findings",
            "case",
        ],
    )
    write_table(workspace.preprocess / "quality.csv", quality)
    history = [
        {
            "epoch": n,
            "train_forecast_mse": 0.5,
            "train_reconstruction_mse": 0.1,
            "train_next_mse": 1.0,
            "validation_forecast_mse": 0.4,
            "validation_next_mse": 0.9,
            "validation_loss": 1.3,
        }
        for n in range(3)
    ]
    summary = {
        "history": history,
        "windows_seen": 480,
        "training_windows": 240,
        "best_validation_loss": 0.4,
    }
    write_json(workspace.train / "training.json", dict.fromkeys(SETUPS, summary))
    limits = {
        "thresholds": {"score": 0.1, "reconstruction": 0.1, "variance": 0.01},
        "sigma": dict.fromkeys(DEPLOYED, 0.1),
        "operating": dict.fromkeys(DEPLOYED, 0.09),
        "promise": "at most 27% of fresh blocks raise an alarm",
        "operating_hours": 8.0,
        "operating_pooled": 0,
        "calibration_hours": 8.0,
    }
    for setup in SETUPS:
        write_json(workspace.tuned(setup), {"members": {setup: study(2)}})
        write_json(workspace.thresholds(setup), {"members": {setup: limits}})
        write_assessments(workspace, setup)


def study(layers: int) -> dict[str, object]:
    """Return a member's tuning: a complete trial, a better one, and a pruned one."""
    trials = [
        {"number": number, "state": state, "validation_loss": error}
        for number, state, error in ((0, "complete", 0.4), (1, "complete", 0.3), (2, "pruned", 0.5))
    ]
    return {
        "configured": trials[0],
        "tuned": {"twin.layers": layers},
        "best_validation_loss": 0.3,
        "trials": trials,
    }


def write_assessments(workspace: Workspace, setup: str) -> None:
    rows = [
        {
            "recording": DISTURBED,
            "issued_s": start,
            "start_s": start + 1,
            "end_s": start + 60,
            "score": 0.2 if 420 <= start < 840 else 0.05,
            "uncertainty_variance": 0.005,
            "category": "red" if 420 <= start < 840 else "green",
            "state_attribution": {"Yaw Rate": 0.3} if 420 <= start < 840 else {},
        }
        for start in range(60, 1140, 60)
    ]
    workspace.evaluate.mkdir(parents=True, exist_ok=True)
    workspace.assessments(setup).write_text(json.dumps(rows))
    pd.concat(
        score_rows(name, disturbed=name == DISTURBED) for name in (DISTURBED, CLEAN)
    ).to_parquet(workspace.scores(setup), index=False)


def score_rows(recording: str, *, disturbed: bool) -> pd.DataFrame:
    """Return scores that rise 10 s after the onset; the monitor's first ones are not known yet."""
    times = np.arange(60.0, 1200.0)
    waves = 0.05 + 0.03 * np.sin(times / 7)
    raised = disturbed & (times >= EVENT[0] + 10) & (times < EVENT[1])
    scores = pd.DataFrame({"recording": recording, "time_s": times})
    for number, detector in enumerate(DEPLOYED):
        scores[detector] = waves + raised * (0.2 - 0.02 * number)
    scores.loc[times < 70, "odisar"] = np.nan
    return scores


def write_examples(workspace: Workspace) -> None:
    folder = report_folder(workspace.root) / "examples"
    units = dict.fromkeys(("Rudder Angle", *STATES), "deg")
    chosen = {
        "disturbed": {"recording": DISTURBED, "events": [EVENT], "units": units},
        "clean": {"recording": CLEAN, "events": [], "units": units},
    }
    write_json(folder / "chosen.json", {"vessel": chosen})
    pd.DataFrame(
        [
            (
                setup,
                setup,
                name,
                1.0 if name == DISTURBED else "",
                name == DISTURBED,
                name == DISTURBED,
                json.dumps([EVENT] if name == DISTURBED else []),
            )
            for setup in SETUPS
            for name in (DISTURBED, CLEAN)
        ],
        columns=[
            "setup",
            "member",
            "recording",
            "strength",
            "is_disturbed",
            "is_overall",
            "events",
        ],
    ).assign(
        case="vessel",
        disturbance=lambda table: np.where(table.is_disturbed, "case-3", "none"),
        components=lambda table: np.where(table.is_disturbed, "all", "none"),
        fault_channel="",
        fault_size="",
    ).to_csv(folder / "recordings.csv", index=False)
    times = np.arange(0.0, 1200.0, 10.0)
    pd.concat(
        pd.DataFrame(
            {
                "case": "vessel",
                "recording": name,
                "time_s": times,
                "channel": channel,
                "value": np.sin(times / 60),
            }
        )
        for name in (DISTURBED, CLEAN)
        for channel in ("Rudder Angle", *STATES)
    ).to_parquet(folder / "traces.parquet")
    ahead = 600.0 + np.arange(1.0, 61.0)
    pd.concat(
        pd.DataFrame(
            {
                "setup": setup,
                "recording": DISTURBED,
                "issued_s": 600.0,
                "time_s": ahead,
                "state": state,
                "forecast": 0.0,
                "reconstruction": 0.1,
                "low": -0.1,
                "high": 0.1,
                "truth": 0.0,
            }
        )
        for setup in SETUPS
        for state in STATES
    ).to_parquet(folder / "forecasts.parquet")
