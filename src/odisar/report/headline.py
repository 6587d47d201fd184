"""The result in a table that fits a terminal."""

from typing import Any

import pandas as pd

from odisar.report.detectors import ORACLE
from odisar.report.load import OVERALL
from odisar.report.picking import shown_detectors

#: Metric in ``detection.csv``, heading, whether it is a share shown in percent.
_COLUMNS = (
    ("auroc", "AUROC %", True),
    ("tnr_at_tpr95", "TNR@TPR95 %", True),
    ("f1_ind", "F1 IND %", True),
    ("f1_ood", "F1 OOD %", True),
    ("false_alarms_per_hour", "false alarms/h", False),
    ("events_detected", "detected %", True),
    ("delay_p50_s", "delay p50 s", False),
)


def headline_table(
    detection: pd.DataFrame, protocol: str = "P2", *, every_detector: bool = False
) -> pd.DataFrame:
    """Return set-up, strength, detector and the headline metrics with their intervals, as text.

    ``detection`` is ``reports/results/detection.csv``; rows are its overall ones, of the twin's
    scores and of the best cheap alternative unless ``every_detector`` is asked for. False alarms
    do not depend on a strength, so they stand in every row of their set-up and detector.
    """
    chosen = detection[(detection.protocol == protocol) & (detection.evaluated_on == OVERALL)]
    chosen = chosen[chosen.detector != ORACLE]
    rows = []
    for (setup, detector), group in chosen.groupby(["setup", "detector"], sort=False):
        if not every_detector and detector not in shown_detectors(detection, str(setup)):
            continue
        alarms = group[group.metric == "false_alarms_per_hour"]
        judged = group[group.metric != "false_alarms_per_hour"]
        # Without a disturbed test recording there are still false alarms to tell.
        parts = list(judged.groupby("strength", dropna=False)) or [(float("nan"), judged)]
        for strength, part in parts:
            values = pd.concat([part, alarms]).set_index("metric")
            row = {"set-up": setup, "strength": f"{strength:g}", "detector": detector}
            row |= {
                heading: _cell(values, metric, percent=percent)
                for metric, heading, percent in _COLUMNS
            }
            rows.append(row)
    return pd.DataFrame(rows).replace({"strength": {"nan": ""}})


def headline_text(detection: pd.DataFrame) -> str:
    """Return the headline table for a terminal."""
    title = (
        "Protocol P2 (the score at t against 'disturbed at t'), 95 % intervals in brackets; of the "
        "cheap\nalternatives the best one (all are in reports/results/detection.csv)"
    )
    return f"{title}\n{headline_table(detection).to_string(index=False)}"


def _cell(values: pd.DataFrame, metric: str, *, percent: bool) -> str:
    if metric not in values.index or values["value"].isna()[metric]:
        return "-"
    scale, digits = (100, 1) if percent else (1, 1)
    row: Any = values.loc[metric]
    text = f"{row['value'] * scale:.{digits}f}"
    if pd.isna(row["ci_low"]) or pd.isna(row["ci_high"]):
        return text
    return f"{text} [{row['ci_low'] * scale:.{digits}f}, {row['ci_high'] * scale:.{digits}f}]"
