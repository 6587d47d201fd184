"""Changes to invented results, each of which a test asks about."""

import json

import numpy as np
import pandas as pd

from odisar.report.load import Results

from .invented import CLEAN, DISTURBED, EVENT


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


def with_scenarios(results: Results) -> None:
    """Let every result be judged by disturbance as well, and wind alone apart."""
    known = results.examples.recordings
    disturbed = known[known.recording == DISTURBED]
    for column, value in (("disturbance", "case-1"), ("components", "wind")):
        copies = disturbed.assign(recording=f"{DISTURBED}-{value}", **{column: value})
        for _, row in copies.iterrows():
            known.loc[len(known)] = row
    for name in ("detection", "quadrants"):
        table = getattr(results, name)
        overall = table[table.evaluated_on == "overall"]
        parts = [overall.assign(evaluated_on=value) for value in ("case-1", "case-3", "wind")]
        setattr(results, name, pd.concat([table, *parts], ignore_index=True))


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
    results.paired = results.paired.iloc[:0]
    results.blame = results.blame.iloc[:0]
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


def change_pair(results: Results, other: str, metric: str, *values: float) -> None:
    """Overwrite difference and interval of a pair of set-up vessel-all, at every strength."""
    table = results.paired
    rows = (table.setup == "vessel-all") & (table.other == other) & (table.metric == metric)
    for name, value in zip(("difference", "ci_low", "ci_high"), values, strict=True):
        table.loc[rows, name] = value
