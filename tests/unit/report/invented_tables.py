"""Invented tables of detection and confidence."""

import numpy as np
import pandas as pd

SETUPS = ("vessel-all", "vessel-random")
DETECTORS = ("odisar", "without-transformer", "reconstruction", "rmse", "mahalanobis", "oracle")
#: Those that can be deployed; the last is judged as the monitor alone.
DEPLOYED = DETECTORS[:-1]
STRENGTHS = (0.25, 1.0)
PUBLISHED = ("odisar", "reconstruction", "rmse")
STATES = ("Surge Speed", "Sway Speed", "Yaw Rate", "Roll Angle", "Roll Rate")


def detection_rows() -> pd.DataFrame:
    rows = []
    for setup in SETUPS:
        for strength in STRENGTHS:
            for protocol in ("P1", "P2", "P2-guarded", "proactive"):
                for detector in DETECTORS:
                    if protocol != "P2" and detector == "mahalanobis":
                        continue
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
                            0.9 if strength == 1.0 and detector in PUBLISHED else np.nan,
                        )
                        for metric in ("auroc", "tnr_at_tpr95", "f1_ind", "f1_ood")
                    ]
            for detector in DEPLOYED:
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
            for detector in DEPLOYED
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


def attribution_rows() -> pd.DataFrame:
    return pd.DataFrame(
        [(setup, "overall", 1.0, state, 30, 0.2, 0.6) for setup in SETUPS for state in STATES],
        columns=["setup", "evaluated_on", "strength", "state", "flagged_windows", "top_1", "top_3"],
    )


def blame_rows() -> pd.DataFrame:
    """Two faults: one whose channel is named, one whose channel is named by chance at most."""
    rows = [
        (
            setup,
            attribution,
            fault,
            "any",
            40,
            8,
            hit,
            hit - 0.1,
            hit + 0.1,
            0.9,
            0.8,
            1.0,
            0.2,
            0.6,
        )
        for setup in SETUPS
        for attribution in ("odisar", "reconstruction")
        for fault, hit in (("any", 0.8), ("bias 1 sd", 0.9), ("stuck", 0.25))
    ]
    columns = "setup attribution fault guilty windows recordings hit_1 hit_1_low hit_1_high"
    columns += " hit_3 hit_3_low hit_3_high chance_1 chance_3"
    return pd.DataFrame(rows, columns=columns.split())


def reliability_rows() -> pd.DataFrame:
    shares = {"draws": 0.3, "draws-plus-noise": 0.88, "recalibrated": 0.9}
    rows = [
        (setup, name, state, metric, value, value - 0.05, value + 0.05, 50)
        for setup in SETUPS
        for name, share in shares.items()
        for state in ("all", *STATES)
        for metric, value in (
            *((f"coverage-{level:g}", share * level / 0.9) for level in (0.5, 0.8, 0.9, 0.95)),
            ("miscalibration", 0.1),
            ("sharpness", 0.4),
            ("crps", 0.3),
            ("sharpness-physical", 0.8),
            ("crps-physical", 0.6),
        )
    ]
    columns = "setup distribution state metric value ci_low ci_high windows"
    return pd.DataFrame(rows, columns=columns.split())


def reliability_curve_rows() -> pd.DataFrame:
    slopes = {"draws": 0.3, "draws-plus-noise": 0.9, "recalibrated": 1.0}
    rows = [
        (setup, name, state, level, seen, seen - 0.03, seen + 0.03)
        for setup in SETUPS
        for name, slope in slopes.items()
        for state in ("all", *STATES)
        for level in np.arange(1, 20) / 20
        for seen in [0.5 + slope * (level - 0.5)]
    ]
    columns = "setup distribution state level observed ci_low ci_high"
    return pd.DataFrame(rows, columns=columns.split())
