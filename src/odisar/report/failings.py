"""What does not work: each check looks for one failing, and says it where it is there."""

import pandas as pd

from odisar.report.alarm_failings import alarm_failings
from odisar.report.confidence_failings import confidence_failings
from odisar.report.detectors import MONITOR, ORACLE, detector_name
from odisar.report.figures.pairs import pairs_of
from odisar.report.gains import HARMS, by_metric, is_worse, metrics_at, verdict
from odisar.report.load import OVERALL, Results, rows_of
from odisar.report.names import METRIC_NAMES
from odisar.report.picking import Value, at_strength, percent, pick, same_strength

#: AUROC below which a strength is called hard to see: every fifth pair of a disturbed and an
#: undisturbed moment is then ranked the wrong way round.
_WEAK_AUROC = 0.8
#: AUROC below which a scenario is called not seen: nearer to a coin (one half) than a weak one.
_UNSEEN_AUROC = 0.6
_COMPARED = ("auroc", "tnr_at_tpr95", "f1_ood")


def failings(results: Results, setup: str) -> list[str]:
    """Return a sentence for every failing found in a set-up's results."""
    checks = (
        _below_others,
        _below_published,
        _weak,
        _unseen,
        alarm_failings,
        confidence_failings,
    )
    found = [sentence for check in checks for sentence in check(results, setup)]
    return found or ["None of the failings that were looked for."]


def _below_others(results: Results, setup: str) -> list[str]:
    """Name every detector that is better in some metric: by how much, and if beyond doubt."""
    rows = pairs_of(results, setup)
    sentences = []
    for other, part in rows.groupby("other", sort=False):
        worse = [row for row in rows_of(part) if is_worse(row)]
        clear = [row for row in worse if verdict(row) == HARMS]
        doubtful = [row for row in worse if verdict(row) != HARMS]
        parts = [by_metric(clear)] if clear else []
        if doubtful:
            parts.append(f"not beyond the interval in {metrics_at(doubtful)}")
        if parts:
            name = detector_name(str(other))
            sentences.append(f"ODiSAR is behind {name}: {'; '.join(parts)}.")
    return sentences


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
        same = same_strength(rows[rows.evaluated_on == row.evaluated_on], row.strength)
        better = _clearly_better(same, value)
        outdone += bool(better)
        name = f"{row.evaluated_on} {at_strength(row.strength)}".strip()
        told.append(f"{name}: {percent(value)}{better}")
    place = "for the others" if outdone else "there"
    rest = f" No other detector is clearly better {place}." if outdone < len(told) else ""
    return [
        (
            f"Hardly seen or not at all (AUROC under P2 below {100 * _UNSEEN_AUROC:g} %, or its "
            f"interval includes one half): {'; '.join(told)}.{rest}"
        )
    ]


def _clearly_better(rows: pd.DataFrame, own: Value) -> str:
    """Name the best other detector whose interval lies above the monitor's; empty for none."""
    above = rows[(rows.detector != ORACLE) & (rows.ci_low > own.high)]
    if above.empty:
        return ""
    best = next(rows_of(above.nlargest(1, "value")))
    return f", {detector_name(best.detector)} clearly better with {100 * best.value:.1f} %"
