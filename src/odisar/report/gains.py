"""What the Transformer adds to the score, and what the monitor has over other scores."""

from collections.abc import Sequence
from typing import Any

import pandas as pd

from odisar.report.detectors import RECONSTRUCTION, WITHOUT_TRANSFORMER, detector_name
from odisar.report.figures.pairs import pairs_of
from odisar.report.load import Results, rows_of
from odisar.report.names import METRIC_NAMES, SHARES, strength_name

#: Of these, less is better.
_LESS_IS_BETTER = ("delay_p50_s",)
ADDS, NOTHING, HARMS, UNKNOWN = "adds", "nothing", "harms", "unknown"


def transformer_gain(results: Results, setup: str) -> list[str]:
    """Say where the Transformer adds something, where nothing, and where it harms (P2, overall)."""
    rows = _against(results, setup, WITHOUT_TRANSFORMER)
    if rows.empty:
        return [f"{setup}: nothing was compared with the score without its Transformer."]
    by_verdict: dict[str, list[Any]] = {}
    for row in rows_of(rows):
        by_verdict.setdefault(verdict(row), []).append(row)
    found = {
        name: by_metric(own) if name in (ADDS, HARMS) else metrics_at(own)
        for name, own in by_verdict.items()
    }
    parts = [f"something in {found[ADDS]}" if ADDS in found else "nothing"]
    if HARMS in found:
        parts.append(f"it harms {found[HARMS]}")
    if NOTHING in found:
        parts.append(f"no difference beyond {_interval(results)} in {found[NOTHING]}")
    if UNKNOWN in found:
        parts.append(f"too few recordings for an interval in {found[UNKNOWN]}")
    head = f"{setup}: what the Transformer adds to the rest of the score (P2, overall)"
    return [f"{head}: {'; '.join(parts)}."]


def monitor_gain(results: Results, setup: str) -> list[str]:
    """Say how the monitor does against the paper's score and the best of all others (AUROC)."""
    rows = pairs_of(results, setup)
    rows = rows[(rows.metric == "auroc") & rows.difference.notna()]
    sentences = []
    own = rows[rows.other == RECONSTRUCTION]
    if not own.empty:
        told = ", ".join(difference(row) for row in rows_of(own))
        sentences.append(f"AUROC minus that of the paper's score: {told}.")
    best = rows[rows.is_next_best]
    if not best.empty:
        told = "; ".join(
            f"{detector_name(str(other))} {', '.join(difference(row) for row in rows_of(part))}"
            for other, part in best.groupby("other", sort=False)
        )
        sentences.append(f"AUROC minus that of the best other detector: {told}.")
    return sentences


def verdict(row: Any) -> str:
    """Return whether a pair's interval is on the better side of 0, around it, or on the worse."""
    if pd.isna(row.difference) or pd.isna(row.ci_low) or pd.isna(row.ci_high):
        return UNKNOWN
    low, high = row.ci_low, row.ci_high
    if row.metric in _LESS_IS_BETTER:
        low, high = -high, -low
    if low > 0:
        return ADDS
    return HARMS if high < 0 else NOTHING


def is_worse(row: Any) -> bool:
    """Whether the monitor has the worse value of a pair, beyond doubt or not."""
    return bool(row.difference > 0 if row.metric in _LESS_IS_BETTER else row.difference < 0)


def _against(results: Results, setup: str, other: str) -> pd.DataFrame:
    rows = pairs_of(results, setup)
    return rows[rows.other == other].sort_values(["strength"], kind="stable")


def _interval(results: Results) -> str:
    return f"the {100 * results.config.evaluation.confidence:g} % interval"


def by_metric(rows: Sequence[Any]) -> str:
    """Return metrics with their strengths, and the largest difference of each with its interval."""
    return ", ".join(_largest(metric, own) for metric, own in _grouped(rows).items())


def metrics_at(rows: Sequence[Any]) -> str:
    """Return metrics with their strengths alone."""
    return ", ".join(f"{_name(m)}{_bracketed(_at(own))}" for m, own in _grouped(rows).items())


def _grouped(rows: Sequence[Any]) -> dict[str, list[Any]]:
    grouped: dict[str, list[Any]] = {}
    for row in rows:
        grouped.setdefault(row.metric, []).append(row)
    return grouped


def _name(metric: str) -> str:
    return "the median delay" if metric in _LESS_IS_BETTER else METRIC_NAMES[metric]


def _largest(metric: str, rows: Sequence[Any]) -> str:
    largest = max(rows, key=lambda row: abs(row.difference))
    if len(rows) == 1:
        return f"{_name(metric)} ({difference(largest)})"
    return f"{_name(metric)} ({_at(rows)}; at most {difference(largest)})"


def _at(rows: Sequence[Any]) -> str:
    strengths = [strength_name(row.strength) for row in rows if pd.notna(row.strength)]
    if not strengths:
        return ""
    return f"at {'strength' if len(strengths) == 1 else 'strengths'} {', '.join(strengths)}"


def _bracketed(text: str) -> str:
    return f" ({text})" if text else ""


def difference(row: Any) -> str:
    """Return a pair's difference with its interval, unit and strength."""
    scale, unit = (100, "points") if row.metric in SHARES else (1, "s")
    text = signed(scale * row.difference)
    if pd.notna(row.ci_low) and pd.notna(row.ci_high):
        text += f" [{signed(scale * row.ci_low)}, {signed(scale * row.ci_high)}]"
    at = "" if pd.isna(row.strength) else f" at strength {strength_name(row.strength)}"
    return f"{text} {unit}{at}"


def signed(value: float) -> str:
    """Return a number with its sign and two decimals, or one digit where that would be none."""
    return f"{value:+.1g}" if 0 < abs(value) < 0.005 else f"{value:+.2f}"
