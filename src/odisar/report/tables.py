"""Result tables as the report prints them: text cells, intervals in brackets, published beside."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from odisar.report.detectors import ORACLE, detector_name
from odisar.report.headline import headline_table
from odisar.report.load import OVERALL, Results, rows_of
from odisar.report.names import METRIC_NAMES, QUADRANT_NAMES, SHARES, strength_name
from odisar.report.picking import lead_time_note, same_strength

DETECTION_METRICS = ("auroc", "tnr_at_tpr95", "f1_ind", "f1_ood")
EVENT_METRICS = ("events_detected", "delay_p50_s", "delay_p90_s", "lead_time_p50_s")

#: The paper's table of model and training parameters, by name in ``params.yaml``. A quotation, so
#: it stays what it is when someone changes the profile ``paper``, which no stage reads.
PUBLISHED_PARAMETERS: dict[str, float] = {
    "twin.patch_steps": 1,
    "twin.model_dim": 64,
    "twin.heads": 4,
    "twin.layers": 3,
    "twin.feedforward_dim": 128,
    "twin.dropout": 0.1,
    "training.learning_rate": 1e-4,
    "training.batch_size": 16,
    "training.epochs": 200,
}


@dataclass(frozen=True)
class Table:
    """A table to print: every row has a text for every column."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    folded: bool = field(default=False)


def frame_table(title: str, frame: pd.DataFrame, note: str = "", *, folded: bool = False) -> Table:
    """Return a table of a frame whose cells are text already."""
    rows = [[str(value) for value in row] for row in frame.itertuples(index=False, name=None)]
    return Table(title, [str(name) for name in frame.columns], rows, note, folded)


def number(value: object, digits: int = 3) -> str:
    """Return a number with so many significant digits; a dash for a missing one."""
    if value is None or pd.isna(value):  # type: ignore[call-overload]
        return "-"
    return f"{float(str(value)):.{digits}g}"


def metric_cell(value: float, low: float, high: float, metric: str) -> str:
    """Return ``value [low, high]``; shares in percent."""
    if pd.isna(value):
        return "-"
    scale = 100 if metric in SHARES else 1
    text = f"{scale * value:.1f}"
    if pd.isna(low) or pd.isna(high):
        return text
    return f"{text} [{scale * low:.1f}, {scale * high:.1f}]"


def headline(results: Results, *, every_detector: bool = False) -> Table:
    """Return the headline table, published values beside those at full strength.

    Of the alternatives only the best is in it, unless ``every_detector`` is asked for.
    """
    rows = results.detection
    rows = rows[(rows.protocol == "P2") & (rows.evaluated_on == OVERALL)]
    frame = headline_table(results.detection, every_detector=every_detector)
    keys = frame[["set-up", "strength", "detector"]]
    published = [
        _published_line(rows, setup, strength, detector)
        for setup, strength, detector in rows_of(keys)
    ]
    frame["detector"] = frame["detector"].map(detector_name)
    frame["published (AUROC / TNR@TPR95 / F1 IND / F1 OOD)"] = published
    told = [name for name in frame.columns if (frame[name] != "").any()]
    note = (
        "95 % intervals in brackets: bootstrap over recordings, exact Poisson for false alarms. "
        "Published values come from other data and another protocol."
    )
    if every_detector:
        return frame_table("Overall, protocol P2, every detector", frame[told], note, folded=True)
    note += " Of the cheap alternatives only that with the best mean AUROC is listed."
    return frame_table("Overall, protocol P2", frame[told], note)


def _published_line(rows: pd.DataFrame, setup: str, strength: str, detector: str) -> str:
    own = rows[(rows.setup == setup) & (rows.detector == detector)]
    own = own[own.strength.map(lambda s: "" if pd.isna(s) else f"{s:g}") == strength]
    values = own.set_index("metric").published.reindex(list(DETECTION_METRICS))
    if values.isna().all():
        return ""
    return " / ".join("-" if pd.isna(value) else f"{100 * value:.1f}" for value in values)


def scenario_tables(results: Results, setup: str) -> list[Table]:
    """Return a table for each strength: scenario by detector under P2, event metrics beside."""
    rows = results.detection
    rows = rows[(rows.setup == setup) & (rows.protocol == "P2") & (rows.detector != ORACLE)]
    metrics = (*DETECTION_METRICS, *EVENT_METRICS)
    rows = rows[rows.metric.isin(metrics)]
    order = list(results.scenarios(setup).evaluated_on)
    tables = []
    for strength in sorted(rows.strength.unique(), key=lambda s: (pd.isna(s), -s)):
        same = same_strength(rows, strength)
        title = f"{setup}: by scenario"
        title += "" if pd.isna(strength) else f", strength {strength_name(strength)}"
        tables.append(
            scenario_table(
                title, same, order, metrics, folded=True, note=lead_time_note(results, setup)
            )
        )
    return tables


def scenario_table(
    title: str,
    rows: pd.DataFrame,
    order: Sequence[str],
    metrics: Sequence[str],
    *,
    folded: bool = False,
    note: str = "",
) -> Table:
    """Return a line for each scenario, in ``order``, and detector; ``rows`` are of one strength."""
    lines = []
    for name, detector in _keys(rows, order):
        own = rows[(rows.evaluated_on == name) & (rows.detector == detector)]
        values = own.set_index("metric")
        cells = [lookup(values, metric) for metric in metrics]
        lines.append([name, detector_name(detector), *cells])
    heads = [METRIC_NAMES[m] + (" %" if m in SHARES else "") for m in metrics]
    return Table(title, ["evaluated on", "detector", *heads], lines, note, folded)


def lookup(values: pd.DataFrame, metric: str) -> str:
    """Return the cell of a metric, by which ``values`` are indexed."""
    if metric not in values.index:
        return "-"
    row: Any = values.loc[metric]
    return metric_cell(row.value, row.ci_low, row.ci_high, metric)


def paper_protocol(results: Results, setup: str) -> Table:
    """Return P1 at the greatest strength, each scenario's oracle and published values beside."""
    rows = results.detection
    rows = rows[(rows.setup == setup) & (rows.protocol == "P1")]
    strongest = results.strengths(setup)[-1]
    title = f"{setup}: protocol P1 beside its oracle"
    title += "" if pd.isna(strongest) else f", strength {strength_name(strongest)}"
    order = list(results.scenarios(setup).evaluated_on)
    return published_beside(title, same_strength(rows, strongest), order, folded=True)


def published_beside(
    title: str,
    rows: pd.DataFrame,
    order: Sequence[str],
    note: str = "",
    *,
    folded: bool = False,
) -> Table:
    """Return detection metrics by scenario (in ``order``) and detector, with what was published.

    ``rows`` are of one protocol and strength. Without a published value there is no such column.
    """
    found = scenario_table(title, rows, order, DETECTION_METRICS, folded=folded, note=note)
    known = rows.set_index(["evaluated_on", "detector", "metric"]).published
    if known.isna().all():
        return found
    lines = []
    for line, (name, detector) in zip(found.rows, _keys(rows, order), strict=True):
        values = [known.get((name, detector, metric), np.nan) for metric in DETECTION_METRICS]
        told = ["-" if pd.isna(value) else f"{100 * value:.1f}" for value in values]
        lines.append([*line, " / ".join(told) if set(told) != {"-"} else ""])
    return replace(found, columns=[*found.columns, "published"], rows=lines)


def _keys(rows: pd.DataFrame, order: Sequence[str]) -> list[tuple[str, str]]:
    """Return scenario and detector of each line of a scenario table."""
    return [
        (name, str(detector))
        for name in order
        for detector in rows[rows.evaluated_on == name].detector.unique()
    ]


def operating(results: Results) -> Table:
    """Return the hours and events behind the operating point."""
    frame = pd.DataFrame(
        [
            {
                "set-up": row.setup,
                "detector": detector_name(row.detector),
                "undisturbed hours": f"{row.hours:.1f}",
                "false alarms": str(row.false_alarms),
                "per hour": metric_cell(row.false_alarms_per_hour, row.ci_low, row.ci_high, ""),
                "events": str(row.events),
                "detected": str(row.events_detected),
            }
            for row in rows_of(results.operating)
        ]
    )
    promised = results.config.evaluation.operating_point.promised_per_hour
    note = f"Promised: at most {promised:g} false alarm(s) per hour. Events of all strengths."
    return frame_table("Operating point", frame, note)


def quadrants(results: Results, setup: str) -> Table:
    """Return the quadrant shares, and those among disturbed and undisturbed windows."""
    own = results.quadrants[results.quadrants.setup == setup]
    order = {name: place for place, name in enumerate(results.scenarios(setup).evaluated_on)}
    own = own.sort_values("evaluated_on", key=lambda names: names.map(order), kind="stable")
    lines = []
    for (name, strength), part in own.groupby(
        ["evaluated_on", "strength"], sort=False, dropna=False
    ):
        by_quadrant = part.set_index("quadrant")
        cells = []
        for quadrant in QUADRANT_NAMES:
            row: Any = by_quadrant.loc[quadrant]
            within = f"{_percent(row.share_of_disturbed)} / {_percent(row.share_of_undisturbed)}"
            share = metric_cell(row.share, row.ci_low, row.ci_high, "auroc")
            cells.append(f"{share} ({within})")
        lines.append(
            [str(name), strength_name(float(str(strength))), str(part.windows.iloc[0]), *cells]
        )
    heads = ["evaluated on", "strength", "windows", *QUADRANT_NAMES.values()]
    note = "Percent with interval; in parentheses the share among disturbed / undisturbed windows."
    return Table(f"{setup}: quadrants", heads, lines, note, folded=True)


def _percent(value: float) -> str:
    return "-" if pd.isna(value) else f"{100 * value:.0f}"


def parameters(results: Results, setup: str) -> Table:
    """Return configured and tuned parameters of a set-up, beside the paper's where it is one.

    Where every fold was tuned on its own, the tuned values are a range over folds.
    """
    config = results.config
    tuned = [member["tuned"] for member in results.tuning(setup).values()]
    is_published = config.setups[setup].published_as is not None
    lines = []
    for name, published in PUBLISHED_PARAMETERS.items():
        section, _, key = name.partition(".")
        configured = getattr(getattr(config, section), key)
        line = [name, number(configured), _tuned_cell([t[name] for t in tuned if name in t])]
        lines.append([*line, number(published)] if is_published else line)
    heads = ["parameter", "configured", "tuned", *(["published"] if is_published else [])]
    note = f"Tuned: from {len(tuned)} folds, each with a study of its own." if tuned[1:] else ""
    return Table(f"{setup}: parameters", heads, lines, note)


def _tuned_cell(values: Sequence[float]) -> str:
    if not values:
        return "not tuned"
    low, high = number(min(values)), number(max(values))
    return low if low == high else f"{low} to {high}"
