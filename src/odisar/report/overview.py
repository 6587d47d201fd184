"""Tables about the experiment itself: splits, nearness, thresholds, quality of the recordings."""

import pandas as pd

from odisar.report.detectors import MONITOR
from odisar.report.load import Results, rows_of
from odisar.report.tables import Table, frame_table, number

#: Of a channel's or fold's many warnings, so many files are listed.
_FILES_LISTED = 40


def splits(results: Results) -> Table:
    """Return recordings, hours and windows of every split; folds are summed."""
    table = results.splits
    folds = table.groupby("setup").fold.nunique()
    summed = table.groupby(["setup", "split"], sort=False)[
        ["recordings", "disturbed", "hours", "windows"]
    ].sum()
    summed = summed.reset_index()
    frame = pd.DataFrame(
        [
            {
                "set-up": row.setup,
                "split": row.split,
                "recordings": str(int(row.recordings)),
                "of these disturbed": str(int(row.disturbed)),
                "hours": f"{row.hours:.1f}",
                "windows": f"{int(row.windows):,}",
            }
            for row in rows_of(summed)
        ]
    )
    note = "Recordings are divided before anything is windowed."
    crossed = [f"{setup} ({count} folds)" for setup, count in folds.items() if count > 1]
    if crossed:
        note += (
            f" Cross-fitted: {', '.join(crossed)}; its rows add up all folds, so that a recording "
            "counts once in test and several times in train."
        )
    return frame_table("Splits", frame, note)


def nearness(results: Results) -> Table:
    """Return how near each split's windows are to their nearest training window."""
    frame = pd.DataFrame(
        [
            {
                "twin": row.member,
                "split": row.split,
                "windows": f"{row.windows:,}",
                "smallest": f"{row.smallest:.3f}",
                "1 %": f"{row.quantile_01:.3f}",
                "median": f"{row.median:.3f}",
                "99 %": f"{row.quantile_99:.3f}",
            }
            for row in rows_of(results.nearness)
        ]
    )
    note = (
        "Root mean square distance of an undisturbed window to its nearest training window, in "
        "scaled units: a copy is at 0, two unrelated windows at about 1.4."
    )
    return frame_table("Nearness to training", frame, note)


def thresholds(results: Results) -> Table:
    """Return every twin's thresholds and the hours of calibration behind them."""
    lines = []
    for setup in results.setups:
        for member, limits in results.limits(setup).items():
            pooled = " (pooled over folds)" if limits["operating_pooled"] else ""
            lines.append(
                [
                    member,
                    number(limits["thresholds"]["score"]),
                    number(limits["operating"][MONITOR]),
                    number(limits["thresholds"]["reconstruction"]),
                    number(limits["thresholds"]["variance"]),
                    f"{limits['calibration_hours']:.2f}",
                    f"{limits['operating_hours']:.2f}{pooled}",
                ]
            )
    heads = [
        "twin",
        "score",
        "alarm",
        "reconstruction",
        "variance",
        "calibration hours",
        "hours behind the alarm threshold",
    ]
    capability = results.config.capability
    note = (
        f"The score's by the rule {capability.threshold_rule!r}, reconstruction and variance (in "
        f"scaled units) at mean + {capability.threshold_sigmas:g} standard deviations, all on "
        "calibration recordings. A score of 1 is usual on validation recordings."
    )
    return Table("Thresholds", heads, lines, note)


def training(results: Results) -> Table:
    """Return how many windows each twin has seen, and its best validation loss."""
    lines = []
    for member, summary in results.training.items():
        seen, available = summary["windows_seen"], summary["training_windows"]
        lines.append(
            [
                member,
                f"{seen:,}",
                f"{available:,}",
                f"{seen / available:.1f}",
                str(len(summary["history"])),
                number(summary["best_validation_loss"]),
            ]
        )
    heads = [
        "twin",
        "windows seen",
        "different windows",
        "passes over them",
        "epochs",
        "best validation loss (both forecasts)",
    ]
    return Table("Windows seen in training", heads, lines)


def quality(results: Results) -> Table:
    """Return what the checks found, case by case, and the files with a warning."""
    table = results.quality
    lines = []
    for case, own in table.groupby("case", sort=False):
        warned = own[own.warnings.astype(int) > 0]
        lines.append(
            [
                str(case),
                "all files",
                f"{len(own)}",
                f"{own.seconds.astype(float).sum() / 3600:.1f}",
                str(int(own.gaps.astype(int).sum())),
                str(int(own.warnings.astype(int).sum())),
                "" if len(warned) else "nothing found",
            ]
        )
        lines += [
            [
                str(case),
                row.file,
                "1",
                f"{float(row.seconds) / 3600:.2f}",
                str(row.gaps),
                str(row.warnings),
                str(row.findings),
            ]
            for row in rows_of(warned.head(_FILES_LISTED))
        ]
        if len(warned) > _FILES_LISTED:
            lines.append([str(case), f"and {len(warned) - _FILES_LISTED} more", *[""] * 5])
    heads = ["case", "file", "files", "hours", "gaps", "warnings", "findings"]
    return Table("Quality of the recordings", heads, lines)


def plausibility(title: str, table: pd.DataFrame, note: str) -> Table:
    """Return what a simulated machine does beside what machines of its kind do."""
    lines = [
        [
            row.quantity,
            number(row.value),
            "" if str(row.unit) == "1" else str(row.unit),
            f"{number(row.low)} to {number(row.high)}",
            "yes" if row.plausible else "no",
        ]
        for row in rows_of(table)
    ]
    heads = ["quantity", "simulated", "unit", "plausible range", "inside"]
    return Table(title, heads, lines, note)


def sea_trial(table: pd.DataFrame) -> Table:
    """Return error and correlation of the equations against the measured trial."""
    lines = [
        [row.state, row.unit, number(row.rmse), f"{row.correlation:.3f}"] for row in rows_of(table)
    ]
    note = "The model's authors calibrated it on this trial: it validates the implementation."
    return Table("Against the sea trial", ["state", "unit", "RMSE", "correlation"], lines, note)
