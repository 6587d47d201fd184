"""What metrics, quadrants and scenarios are called, in tables and figures."""

import pandas as pd

QUADRANT_NAMES = {
    "green": "IND, confident",
    "yellow": "IND, uncertain",
    "orange": "OOD, uncertain",
    "red": "OOD, confident",
}
METRIC_NAMES = {
    "auroc": "AUROC",
    "tnr_at_tpr95": "TNR@TPR95",
    "f1_ind": "F1 IND",
    "f1_ood": "F1 OOD",
    "events_detected": "events detected",
    "false_alarms_per_hour": "false alarms per hour",
    "delay_p50_s": "delay p50 [s]",
    "delay_p90_s": "delay p90 [s]",
    "lead_time_p50_s": "lead time p50 [s]",
    "vus_pr": "VUS-PR",
}
#: Metrics that are shares, shown in percent.
SHARES = ("auroc", "tnr_at_tpr95", "f1_ind", "f1_ood", "events_detected", "vus_pr")


def strength_name(strength: float) -> str:
    """Return a strength for an axis; recordings without one are simply all of them."""
    return "all" if pd.isna(strength) else f"{strength:g}"


def with_strength(scenario: str, strength: float) -> str:
    """Return a scenario's name with its strength, if it has one, for an axis."""
    return scenario if pd.isna(strength) else f"{scenario}, {strength_name(strength)}"
