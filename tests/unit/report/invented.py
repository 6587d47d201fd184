"""A workspace of small, invented results: enough for tables, sentences and figures."""

import json
from pathlib import Path

import numpy as np
import pandas as pd

from odisar.artifacts import Workspace, write_json, write_table
from odisar.report.load import Results, report_folder

from .invented_tables import SETUPS, detection_rows, quadrant_rows

ROOT = Path(__file__).parents[3]
STATES = ("Surge Speed", "Sway Speed", "Yaw Rate", "Roll Angle", "Roll Rate")
DISTURBED, CLEAN = "test-turning-20-case-3-s1", "test-turning-20-clean-1"
EVENT = [420.0, 840.0]


def write_results(workspace: Workspace) -> None:
    write_table(workspace.results / "detection.csv", detection_rows())
    write_table(workspace.results / "quadrants.csv", quadrant_rows())
    operating = pd.DataFrame(
        [
            (setup, name, 20, 1000, 8.0, 4, 0.5, 0.2, 0.9, 10, 8)
            for setup in SETUPS
            for name in ("odisar", "rmse")
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
    write_table(workspace.results / "operating.csv", operating)
    attribution = pd.DataFrame(
        [(setup, "overall", 1.0, state, 30, 0.2, 0.6) for setup in SETUPS for state in STATES],
        columns=["setup", "evaluated_on", "strength", "state", "flagged_windows", "top_1", "top_3"],
    )
    write_table(workspace.results / "attribution.csv", attribution)
    nearness = pd.DataFrame(
        [(setup, "test", 100, 0.2, 0.2, 0.3, 0.6) for setup in SETUPS],
        columns=["member", "split", "windows", "smallest", "quantile_01", "median", "quantile_99"],
    )
    write_table(workspace.results / "nearness.csv", nearness)


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
            "validation_forecast_mse": 0.4,
        }
        for n in range(3)
    ]
    summary = {
        "history": history,
        "windows_seen": 480,
        "training_windows": 240,
        "best_validation_forecast_mse": 0.4,
    }
    write_json(workspace.train / "training.json", dict.fromkeys(SETUPS, summary))
    limits = {
        "thresholds": {"reconstruction": 0.1, "variance": 0.01},
        "sigma": {"odisar": 0.1},
        "operating": {"odisar": 0.09},
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
        {"number": number, "state": state, "validation_forecast_mse": error}
        for number, state, error in ((0, "complete", 0.4), (1, "complete", 0.3), (2, "pruned", 0.5))
    ]
    return {
        "configured": trials[0],
        "tuned": {"twin.layers": layers},
        "best_validation_forecast_mse": 0.3,
        "trials": trials,
    }


def write_assessments(workspace: Workspace, setup: str) -> None:
    rows = [
        {
            "recording": DISTURBED,
            "issued_s": start,
            "start_s": start + 1,
            "end_s": start + 60,
            "reconstruction_error": 0.2 if 420 <= start < 840 else 0.05,
            "uncertainty_variance": 0.005,
            "category": "red" if 420 <= start < 840 else "green",
            "state_attribution": {"Yaw Rate": 0.3} if 420 <= start < 840 else {},
        }
        for start in range(60, 1140, 60)
    ]
    workspace.evaluate.mkdir(parents=True, exist_ok=True)
    workspace.assessments(setup).write_text(json.dumps(rows))
    times = np.arange(60.0, 1200.0)
    scores = np.where((times >= 420) & (times < 840), 0.2, 0.05)
    pd.DataFrame({"recording": DISTURBED, "time_s": times, "odisar": scores}).to_parquet(
        workspace.scores(setup)
    )


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
    ).assign(disturbance="", fault_channel="", fault_size="").to_csv(
        folder / "recordings.csv", index=False
    )
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


def add(results: Results, metric: str, detector: str, **columns: object) -> None:
    """Add a P2 row to the detection table of set-up vessel-all."""
    row = {"setup": "vessel-all", "protocol": "P2", "metric": metric, "detector": detector}
    results.detection.loc[len(results.detection)] = pd.Series(row | columns)


def with_faults(results: Results, *names: str) -> None:
    """Add copies of the clean test recording with a fault, by kind and size, as "bias 1 sd"."""
    known = results.examples.recordings
    clean = known[known.recording == CLEAN]
    for name in names:
        kind, _, size = name.partition(" ")
        copy = clean.assign(
            recording=f"{CLEAN}-{name}",
            is_disturbed=True,
            is_overall=True,
            events=json.dumps([EVENT]),
            disturbance=kind,
            fault_channel="Yaw Rate",
            fault_size=size,
        )
        for _, row in copy.iterrows():
            known.loc[len(known)] = row


def since_1970(results: Results) -> float:
    """Let the recordings' clocks begin far from zero; return at which second."""
    start_s = 1.7e9
    examples = results.examples
    examples.traces["time_s"] += start_s
    examples.forecasts[["time_s", "issued_s"]] += start_s
    examples.chosen["vessel"]["disturbed"]["events"] = [[start_s + time for time in EVENT]]
    return start_s


def without_disturbed(results: Results) -> None:
    """Leave what is known where no test recording is disturbed."""
    results.detection = results.detection[results.detection.metric == "false_alarms_per_hour"]
    results.quadrants = results.quadrants.iloc[:0]
    results.attribution = results.attribution.iloc[:0]
    known = results.examples.recordings
    known["is_disturbed"] = known["is_overall"] = False
    known["events"] = "[]"
    known["strength"] = np.nan
    for kind in results.examples.chosen["vessel"].values():
        kind["events"] = []


def change(results: Results, metric: str, detector: str = "odisar", **columns: float) -> None:
    """Overwrite the overall P2 rows of a metric of set-up vessel-all."""
    table = results.detection
    rows = (table.setup == "vessel-all") & (table.metric == metric)
    rows &= (table.detector == detector) & (table.protocol == "P2")
    for name, value in columns.items():
        table.loc[rows, name] = value
