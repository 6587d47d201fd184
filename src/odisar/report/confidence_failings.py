"""What does not work about confidence and blame, and what leaks."""

from typing import Any

import pandas as pd

from odisar.evaluation.leakage_probes import CONTROL
from odisar.report.detectors import MONITOR, NOT_DEPLOYABLE, detector_name
from odisar.report.figures.blame import ANY
from odisar.report.figures.leakage import probed
from odisar.report.figures.reliability import ALL_STATES
from odisar.report.load import OVERALL, Results, rows_of
from odisar.report.picking import Value, percent, same_strength

#: Variance tells windows apart if its share above the threshold differs by more than this: a
#: choice of ours, a quarter of the windows being the least that could serve as an alarm.
_TELLING_DIFFERENCE = 0.25
#: The central interval by which forecasts are called too sure or not sure enough.
_COVERAGE = 0.9


def confidence_failings(results: Results, setup: str) -> list[str]:
    """Return a sentence for every failing of a set-up's confidence, blame and causality."""
    checks = (_variance, _coverage, _blame, _leaks)
    return [sentence for check in checks for sentence in check(results, setup)]


def _variance(results: Results, setup: str) -> list[str]:
    """Say where Monte Carlo variance does not tell disturbed from undisturbed windows."""
    table = results.quadrants
    strongest = results.strengths(setup)[-1]
    rows = table[(table.setup == setup) & (table.evaluated_on == OVERALL)]
    rows = same_strength(rows, strongest)
    uncertain = rows[rows.quadrant.isin(["yellow", "orange"])]
    inside = uncertain.share_of_disturbed.sum(min_count=1)
    outside = uncertain.share_of_undisturbed.sum(min_count=1)
    if pd.isna(inside) or pd.isna(outside) or inside - outside > _TELLING_DIFFERENCE:
        return []
    return [
        (
            "Monte Carlo variance does not separate disturbed from undisturbed windows: "
            f"{100 * inside:.0f} % of the disturbed and {100 * outside:.0f} % of the undisturbed "
            "ones are above its threshold. It is a confidence, not an OOD score."
        )
    ]


def _coverage(results: Results, setup: str) -> list[str]:
    """Say where recalibrated intervals do not hold what they promise, and what draws alone do."""
    rows = results.reliability
    rows = rows[(rows.setup == setup) & (rows.state == ALL_STATES)]
    rows = rows[rows.metric == f"coverage-{_COVERAGE:g}"]
    found = {str(row.distribution): row for row in rows_of(rows)}
    promised = f"{100 * _COVERAGE:g} % intervals"
    sentences = []
    draws, recalibrated = found.get("draws"), found.get("recalibrated")
    if draws is not None and draws.value < _COVERAGE:
        sentences.append(
            f"Monte Carlo draws alone are too sure of themselves: their {promised} hold "
            f"{_interval(draws)} of the truths."
        )
    if recalibrated is not None and _is_apart(recalibrated):
        sentences.append(
            f"Recalibrated {promised} do not hold what they promise: {_interval(recalibrated)} of "
            "the truths."
        )
    return sentences


def _is_apart(row: Any) -> bool:
    return bool(row.ci_high < _COVERAGE or row.ci_low > _COVERAGE)


def _interval(row: Any) -> str:
    return percent(Value(row.value, row.ci_low, row.ci_high, float("nan")))


def _blame(results: Results, setup: str) -> list[str]:
    """Name the faults whose channel is named first no more often than by chance."""
    rows = results.blame
    rows = rows[(rows.setup == setup) & (rows.attribution == MONITOR) & (rows.guilty == ANY)]
    rows = rows[~(rows.hit_1_low > rows.chance_1)]
    told = [
        f"{'all faults' if row.fault == ANY else row.fault} {100 * row.hit_1:.0f} % "
        f"(by chance {100 * row.chance_1:.0f} %, {row.windows} windows)"
        for row in rows_of(rows)
    ]
    if not told:
        return []
    return [
        (
            "The guilty channel is not named first more often than by chance, as far as the "
            f"interval tells: {', '.join(told)}."
        )
    ]


def _leaks(results: Results, setup: str) -> list[str]:
    """Name the detectors whose score moved where it must not."""
    table = probed(results, setup)
    wrong = table[~table.passed & (table.probe != CONTROL)]
    wrong = wrong[~wrong.detector.isin(NOT_DEPLOYABLE)]
    return [
        f"Leakage: the score of {detector_name(str(detector))} moves where it must not "
        f"({', '.join(part.probe)})."
        for detector, part in wrong.groupby("detector", sort=False)
    ]
