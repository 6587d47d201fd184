"""What does not work: each check looks for one failing, and says it where it is there."""

import pandas as pd

from odisar.report.load import OVERALL, Results, rows_of
from odisar.report.picking import MONITOR, Value, at_strength, lead_time_note, percent, pick
from odisar.report.style import METRIC_NAMES, detector_name

#: Variance tells windows apart if its share above the threshold differs by more than this: a
#: choice of ours, a quarter of the windows being the least that could serve as an alarm.
_TELLING_DIFFERENCE = 0.25
#: AUROC below which a strength is called hard to see: every fifth pair of a disturbed and an
#: undisturbed moment is then ranked the wrong way round.
_WEAK_AUROC = 0.8
#: AUROC below which a scenario is called not seen: nearer to a coin (one half) than a weak one.
_UNSEEN_AUROC = 0.6
#: Forecast-error detectors have names that begin so.
_FORECAST_ERROR = "rmse"
_COMPARED = ("auroc", "tnr_at_tpr95", "f1_ood")


def failings(results: Results, setup: str) -> list[str]:
    """Return a sentence for every failing found in a set-up's results."""
    checks = (
        _below_baselines,
        _below_published,
        _weak,
        _unseen,
        _promise,
        _promise_by_group,
        _missed,
        _late,
        _variance,
    )
    found = [sentence for check in checks for sentence in check(results, setup)]
    return found or ["None of the failings that were looked for."]


def _below_baselines(results: Results, setup: str) -> list[str]:
    sentences = []
    for other in [name for name in results.detectors(setup) if name != MONITOR]:
        by_strength = [
            _below(results, setup, other, strength) for strength in results.strengths(setup)
        ]
        worse = [text for text in by_strength if text]
        if worse:
            name = detector_name(other)
            sentences.append(f"ODiSAR is below {name} (in percent): {'; '.join(worse)}.")
    return sentences


def _below(results: Results, setup: str, other: str, strength: float) -> str:
    parts = []
    for metric in _COMPARED:
        own = pick(results, setup, MONITOR, metric, strength)
        theirs = pick(results, setup, other, metric, strength)
        if own is None or theirs is None or own.value >= theirs.value:
            continue
        apart = " beyond both intervals" if own.high < theirs.low else ""
        parts.append(
            f"{METRIC_NAMES[metric]} {100 * own.value:.1f} against {100 * theirs.value:.1f}{apart}"
        )
    return f"{at_strength(strength)} {', '.join(parts)}".strip() if parts else ""


def _below_published(results: Results, setup: str) -> list[str]:
    parts = []
    for metric in (*_COMPARED, "f1_ind"):
        own = pick(results, setup, MONITOR, metric)
        if own is not None and own.value < own.published:
            parts.append(
                f"{METRIC_NAMES[metric]} {100 * own.value:.1f} against {100 * own.published:.1f}"
            )
    if not parts:
        return []
    return [f"Under P2 at full strength it is below what was published: {', '.join(parts)} %."]


def _weak(results: Results, setup: str) -> list[str]:
    sentences = []
    for strength in results.strengths(setup):
        value = pick(results, setup, MONITOR, "auroc", strength)
        if value is None:
            continue
        where = at_strength(strength) or "overall"
        if value.low <= 0.5 <= value.high:
            sentences.append(
                f"{where.capitalize()} the score may be no better than a coin: the interval of "
                f"AUROC includes one half, {percent(value)}."
            )
        elif value.value < _WEAK_AUROC:
            sentences.append(f"{where.capitalize()} AUROC is only {percent(value)}.")
    return sentences


def _unseen(results: Results, setup: str) -> list[str]:
    """Name scenarios, components apart included, that the score hardly sees."""
    table = results.detection
    rows = table[(table.setup == setup) & (table.metric == "auroc") & (table.protocol == "P2")]
    rows = rows[(rows.evaluated_on != OVERALL) & rows.value.notna()]
    own = rows[rows.detector == MONITOR]
    own = own[(own.value < _UNSEEN_AUROC) | ((own.ci_low <= 0.5) & (own.ci_high >= 0.5))]
    own = own.sort_values("strength", kind="stable", na_position="first")
    if own.empty:
        return []
    told, outdone = [], 0
    for row in rows_of(own):
        value = Value(row.value, row.ci_low, row.ci_high, row.published)
        same = rows.strength.isna() if pd.isna(row.strength) else rows.strength == row.strength
        better = _clearly_better(rows[same & (rows.evaluated_on == row.evaluated_on)], value)
        outdone += bool(better)
        name = f"{row.evaluated_on} {at_strength(row.strength)}".strip()
        told.append(f"{name}: {percent(value)}{better}")
    place = "for the others" if outdone else "there"
    rest = f" Forecast errors are not clearly better {place}." if outdone < len(told) else ""
    return [
        (
            f"Hardly seen or not at all (AUROC under P2 below {100 * _UNSEEN_AUROC:g} %, or its "
            f"interval includes one half): {'; '.join(told)}.{rest}"
        )
    ]


def _clearly_better(rows: pd.DataFrame, own: Value) -> str:
    """Name the best forecast error whose interval lies above the monitor's; empty for none."""
    above = rows[rows.detector.str.startswith(_FORECAST_ERROR) & (rows.ci_low > own.high)]
    if above.empty:
        return ""
    best = next(rows_of(above.nlargest(1, "value")))
    return f", {detector_name(best.detector)} clearly better with {100 * best.value:.1f} %"


def _promise(results: Results, setup: str) -> list[str]:
    value = pick(results, setup, MONITOR, "false_alarms_per_hour")
    promised = results.config.evaluation.operating_point.promised_per_hour
    if value is None:
        return ["There was no undisturbed test recording, so false alarms were not counted."]
    rate = f"{value.value:.2f} per hour ({value.low:.2f} to {value.high:.2f})"
    return _promise_sentences(value, promised, rate)


def _promise_sentences(value: Value, promised: float, rate: str) -> list[str]:
    if value.value > promised and value.low <= promised:
        return [
            (
                f"The promise of at most {promised:g} false alarm per hour was not held: {rate}; "
                "the interval includes the promise."
            )
        ]
    if value.value > promised:
        return [f"The promise of at most {promised:g} false alarm per hour was broken: {rate}."]
    if value.high > promised:
        return [
            (
                f"False alarms kept the promise of at most {promised:g} per hour, {rate}, but in "
                "too few hours to be sure of it."
            )
        ]
    return []


def _promise_by_group(results: Results, setup: str) -> list[str]:
    """Name manoeuvres (or other groups) whose undisturbed recordings alarm more than promised."""
    promised = results.config.evaluation.operating_point.promised_per_hour
    table = results.detection
    rows = table[(table.setup == setup) & (table.metric == "false_alarms_per_hour")]
    rows = rows[(rows.detector == MONITOR) & (rows.evaluated_on != OVERALL)]
    rows = rows[rows.value > promised].sort_values("value", ascending=False, kind="stable")
    told = [
        f"{row.evaluated_on} {row.value:.2f} per hour ({row.ci_low:.2f} to {row.ci_high:.2f}"
        f"{', which includes the promise' if row.ci_low <= promised else ''})"
        for row in rows_of(rows)
    ]
    if not told:
        return []
    return [
        (
            f"More than the promised {promised:g} false alarm per hour on undisturbed recordings "
            f"of: {', '.join(told)}."
        )
    ]


def _missed(results: Results, setup: str) -> list[str]:
    sentences = []
    for strength in results.strengths(setup):
        value = pick(results, setup, MONITOR, "events_detected", strength)
        if value is not None and value.value < 0.5:
            where = at_strength(strength) or "overall"
            sentences.append(
                f"{where.capitalize()} fewer than half of the events raised an alarm: "
                f"{percent(value)}."
            )
    return sentences


def _late(results: Results, setup: str) -> list[str]:
    value = pick(results, setup, MONITOR, "lead_time_p50_s")
    if value is None or value.value > 0:
        return []
    where = at_strength(results.strengths(setup)[-1]) or "overall"
    late_s = round(-value.value)
    when = f"{late_s} s after" if late_s else "at the moment at which"
    sentence = (
        f"{where.capitalize()} the median alarm comes {when} a state has left its calibrated "
        "range, not before."
    )
    return [f"{sentence} {lead_time_note(results, setup)}".strip()]


def _variance(results: Results, setup: str) -> list[str]:
    """Say where Monte Carlo variance does not tell disturbed from undisturbed windows."""
    table = results.quadrants
    strongest = results.strengths(setup)[-1]
    rows = table[(table.setup == setup) & (table.evaluated_on == OVERALL)]
    rows = rows[rows.strength.isna() if pd.isna(strongest) else rows.strength == strongest]
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
