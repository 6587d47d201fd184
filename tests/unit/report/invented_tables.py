"""Invented result tables."""

import numpy as np
import pandas as pd

SETUPS = ("vessel-all", "vessel-random")
DETECTORS = ("odisar", "rmse", "oracle")
STRENGTHS = (0.25, 1.0)


def detection_rows() -> pd.DataFrame:
    rows = []
    for setup in SETUPS:
        for strength in STRENGTHS:
            for protocol in ("P1", "P2", "P2-guarded", "proactive"):
                for detector in DETECTORS:
                    base = 0.95 if detector == "odisar" else 0.9
                    base = base - 0.1 * (strength < 1)
                    rows += [
                        (
                            setup,
                            "overall",
                            strength,
                            protocol,
                            detector,
                            metric,
                            base,
                            base - 0.02,
                            base + 0.02,
                            0.9 if strength == 1.0 and detector != "oracle" else np.nan,
                        )
                        for metric in ("auroc", "tnr_at_tpr95", "f1_ind", "f1_ood")
                    ]
            for detector in ("odisar", "rmse"):
                for metric, value in (
                    ("events_detected", 0.8),
                    ("delay_p50_s", 12.0),
                    ("delay_p90_s", 30.0),
                    ("lead_time_p50_s", 5.0),
                ):
                    rows.append(
                        (
                            setup,
                            "overall",
                            strength,
                            "P2",
                            detector,
                            metric,
                            value,
                            value * 0.9,
                            value * 1.1,
                            np.nan,
                        )
                    )
        rows += [
            (
                setup,
                "overall",
                np.nan,
                "P2",
                detector,
                "false_alarms_per_hour",
                0.5,
                0.2,
                0.9,
                np.nan,
            )
            for detector in ("odisar", "rmse")
        ]
    columns = "setup evaluated_on strength protocol detector metric value ci_low ci_high published"
    return pd.DataFrame(rows, columns=columns.split())


def quadrant_rows() -> pd.DataFrame:
    shares = {"green": 0.6, "yellow": 0.05, "orange": 0.3, "red": 0.05}
    disturbed = {"green": 0.1, "yellow": 0.0, "orange": 0.8, "red": 0.1}
    undisturbed = {"green": 0.9, "yellow": 0.1, "orange": 0.0, "red": 0.0}
    return pd.DataFrame(
        [
            (
                setup,
                "overall",
                strength,
                name,
                share,
                share - 0.02,
                share + 0.02,
                100,
                disturbed[name],
                undisturbed[name],
                np.nan,
                np.nan,
                "",
            )
            for setup in SETUPS
            for strength in STRENGTHS
            for name, share in shares.items()
        ],
        columns=[
            "setup",
            "evaluated_on",
            "strength",
            "quadrant",
            "share",
            "ci_low",
            "ci_high",
            "windows",
            "share_of_disturbed",
            "share_of_undisturbed",
            "published_low",
            "published_high",
            "published",
        ],
    )
