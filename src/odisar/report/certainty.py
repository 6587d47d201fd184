"""How sure the numbers are: intervals, seeds, hours, and what a promise means."""

from collections.abc import Sequence

from odisar.report.detectors import MONITOR
from odisar.report.load import Results
from odisar.report.study import missing_study, seed_sentences


def certainty(results: Results) -> list[str]:
    """Return sentences on what the numbers rest on."""
    evaluation = results.config.evaluation
    calibration, few = [], []
    for setup in results.setups:
        hours = [limit["operating_hours"] for limit in results.limits(setup).values()]
        calibration.append(f"{_range(hours)} h ({setup})")
        if min(hours) < evaluation.operating_point.pool_below_hours:
            few.append(setup)
    undisturbed = results.operating.groupby("setup").hours.max()
    tested = [f"{undisturbed.get(setup, 0.0):.1f} h ({setup})" for setup in results.setups]
    sentences = [
        (
            f"Brackets are {100 * evaluation.confidence:g} % intervals from "
            f"{evaluation.bootstrap_draws} bootstrap draws over test recordings; recordings that "
            "share a base seed are drawn together. False alarms have exact Poisson intervals."
        ),
        *seed_sentences(results),
        (
            f"Alarm thresholds rest on {', '.join(calibration)} of calibration recordings. False "
            f"alarms were counted in {', '.join(tested)} of undisturbed test recordings."
        ),
    ]
    if few:
        sentences.append(
            f"Fewer than {evaluation.operating_point.pool_below_hours:g} h of calibration "
            f"({', '.join(few)}): the alarm threshold itself is uncertain, and so is the rate of "
            "false alarms elsewhere."
        )
    sentences += _pooling(results)
    return sentences + _conformal(results) + missing_study(results)


def _conformal(results: Results) -> list[str]:
    """Say what the conformal rule promises, which is nothing about an hour, and what it gave."""
    told = [sentence for setup in results.setups for sentence in _promise(results, setup)]
    if not told:
        return []
    return [
        (
            "The conformal threshold promises something per block of time, not per hour, as alarms "
            f"may come in bursts. {' '.join(told)}"
        )
    ]


def _promise(results: Results, setup: str) -> list[str]:
    promises = [limit["promise"] for limit in results.limits(setup).values()]
    rows = results.rules
    rows = rows[(rows.setup == setup) & (rows.detector == MONITOR) & (rows.rule == "conformal")]
    if rows.empty:
        return []
    given = rows.iloc[0]
    which = f" (the first of {len(promises)} folds)" if len(promises) > 1 else ""
    promise = f"{setup}{which}: {promises[0]}"
    if not given.hours > 0:
        return [f"{promise}."]
    return [
        (
            f"{promise}; on undisturbed test recordings it gave an alarm in "
            f"{100 * given.recordings_alarmed:.0f} % of them, and {given.measured_per_hour:.2f} "
            f"per hour ({given.ci_low:.2f} to {given.ci_high:.2f}) in {given.hours:.1f} h."
        )
    ]


def _pooling(results: Results) -> list[str]:
    """Say what an alarm threshold pooled over folds rests on."""
    pooled = [
        setup
        for setup in results.setups
        if any(limit["operating_pooled"] == 1 for limit in results.limits(setup).values())
    ]
    if not pooled:
        return []
    return [
        (
            f"The alarm threshold of a fold ({', '.join(pooled)}) pools the scores of its own "
            "calibration blocks with out-of-fold scores of the other folds' calibration blocks. "
            "None of these is one of the fold's test blocks, but the other folds' twins may have "
            "trained on its test blocks."
        )
    ]


def _range(values: Sequence[float]) -> str:
    low, high = f"{min(values):.1f}", f"{max(values):.1f}"
    return low if low == high else f"{low} to {high}"
