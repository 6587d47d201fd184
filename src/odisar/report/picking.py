"""One number out of the detection table, and how a sentence says it."""

from dataclasses import dataclass

import pandas as pd

from odisar.report.detectors import TWIN_SCORES, alternatives
from odisar.report.load import OVERALL, Results
from odisar.report.names import strength_name

#: More rows than these do not fit on a page.
_DRAWN_SCENARIOS = 36


@dataclass(frozen=True)
class Value:
    """A value of the detection table with its interval; NaN where there is none."""

    value: float
    low: float
    high: float
    published: float


def pick(
    results: Results,
    setup: str,
    detector: str,
    metric: str,
    strength: float | None = None,
    *,
    protocol: str = "P2",
) -> Value | None:
    """Return an overall value of the detection table, or None where there is none.

    ``strength`` None means the greatest there is. Rates of false alarms have no strength.
    """
    table = results.detection
    rows = table[
        (table.setup == setup)
        & (table.detector == detector)
        & (table.metric == metric)
        & (table.evaluated_on == OVERALL)
        & (table.protocol == protocol)
    ]
    if metric != "false_alarms_per_hour":
        at = results.strengths(setup)[-1] if strength is None else strength
        rows = same_strength(rows, at)
    rows = rows[rows.value.notna()]
    if rows.empty:
        return None
    return Value(
        *(float(rows[name].iloc[0]) for name in ("value", "ci_low", "ci_high", "published"))
    )


def best_alternative(detection: pd.DataFrame, setup: str) -> str | None:
    """Return the cheap alternative with the highest mean AUROC over strengths (P2, overall).

    It is the best on the very recordings that it is shown on, so it looks a little better than it
    is. None where there is no alternative with a value.
    """
    rows = detection[(detection.setup == setup) & (detection.evaluated_on == OVERALL)]
    rows = rows[(rows.metric == "auroc") & (rows.protocol == "P2")]
    rows = rows[rows.detector.isin(alternatives(list(rows.detector.unique())))]
    means = rows.groupby("detector", sort=False).value.mean().dropna()
    return None if means.empty else str(means.idxmax())


def shown_detectors(detection: pd.DataFrame, setup: str) -> list[str]:
    """Return what fits in one figure: the twin's scores and the best of the cheap alternatives."""
    there = set(detection[detection.setup == setup].detector)
    best = best_alternative(detection, setup)
    return [name for name in TWIN_SCORES if name in there] + ([best] if best else [])


def drawn_scenarios(results: Results, setup: str) -> pd.DataFrame:
    """Return the scenarios that figures draw: without the finest groupings, if there are many.

    Every combination of fault, size and channel is for tables, and for the heat map of faults.
    """
    scenarios = results.scenarios(setup)
    while len(scenarios) > _DRAWN_SCENARIOS:
        sizes = scenarios[~scenarios.is_apart & (scenarios.group != OVERALL)].group.value_counts()
        if sizes.empty:
            break
        scenarios = scenarios[scenarios.group != sizes.index[0]]
    return scenarios.reset_index(drop=True)


def left_out_note(results: Results, setup: str) -> str:
    """Say which groupings are in the tables alone; empty where all of them are drawn."""
    everything, drawn = results.scenarios(setup), drawn_scenarios(results, setup)
    left = [name for name in everything.group.unique() if name not in set(drawn.group)]
    return f"Not drawn, but in the tables: groups by {', '.join(left)}." if left else ""


def same_strength(rows: pd.DataFrame, strength: float) -> pd.DataFrame:
    """Return the rows of a table at one strength; NaN is that of recordings without one."""
    return rows[rows.strength.isna() if pd.isna(strength) else rows.strength == strength]


def selection(results: Results, setup: str) -> str:
    """Return what a set-up's training is narrowed to, as "maneuver random"; empty if to nothing."""
    select = results.config.setups[setup].select
    return "; ".join(f"{column} {', '.join(values)}" for column, values in select.items())


def lead_time_note(results: Results, setup: str) -> str:
    """Say what lead times of a narrowed set-up are measured against; empty for any other."""
    kept = selection(results, setup)
    if not kept:
        return ""
    return (
        f"Lead times of {setup} are measured against the range of its own calibration recordings "
        f"({kept} only), not of all."
    )


def percent(found: Value) -> str:
    """Return a share in percent with its interval."""
    text = f"{100 * found.value:.1f} %"
    if pd.isna(found.low) or pd.isna(found.high):
        return text
    return f"{text} ({100 * found.low:.1f} to {100 * found.high:.1f})"


def at_strength(strength: float) -> str:
    """Return "at strength 0.5", or nothing for recordings without a strength."""
    return "" if pd.isna(strength) else f"at strength {strength_name(strength)}"
