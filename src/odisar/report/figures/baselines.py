"""The monitor beside other detectors: by strength, by scenario, by protocol."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from odisar.report.detectors import (
    MONITOR,
    NEURAL,
    ORACLE,
    RECONSTRUCTION,
    TWIN_SCORES,
    alternatives,
    detector_look,
    detector_name,
)
from odisar.report.load import OVERALL, Results
from odisar.report.names import METRIC_NAMES, strength_name, with_strength
from odisar.report.picking import drawn_scenarios, same_strength
from odisar.report.style import figure_style

METRICS = ("auroc", "tnr_at_tpr95", "f1_ind", "f1_ood")
_SHOWN = (*TWIN_SCORES, ORACLE)
PROTOCOL_NAMES = {
    "P1": "P1",
    "P2": "P2",
    "P2-guarded": "P2\nguarded",
    "proactive": "pro-\nactive",
}


def baselines_by_strength(results: Results, setup: str) -> Figure:
    """Draw the metrics of the twin's scores over the strength of the disturbance (P2, overall)."""
    return _by_strength(results, setup, results.detection, (*TWIN_SCORES, ORACLE))


def alternatives_by_strength(results: Results, setup: str) -> Figure:
    """Draw the same for the cheap alternatives, and for the monitor."""
    others = alternatives(results.detectors(setup))
    return _by_strength(results, setup, results.detection, (MONITOR, *others))


def study_by_strength(results: Results, setup: str) -> Figure:
    """Draw the same for the networks of the study, and for the monitor and the paper's score."""
    table = results.study("detection")
    assert table is not None  # noqa: S101 (has_study_networks has looked)
    return _by_strength(results, setup, table, (MONITOR, RECONSTRUCTION, *NEURAL))


def has_alternatives(results: Results, setup: str) -> bool:
    """Whether a set-up was judged with any alternative to the twin."""
    names = alternatives(results.detectors(setup))
    rows = _rows(results.detection, setup, "P2")
    return bool((rows.detector.isin(names) & (rows.evaluated_on == OVERALL)).any())


def has_study_networks(results: Results, setup: str) -> bool:
    """Whether the study has judged networks on this set-up."""
    table = results.study("detection")
    return table is not None and bool(table[table.setup == setup].detector.isin(NEURAL).any())


def _by_strength(
    results: Results, setup: str, table: pd.DataFrame, detectors: Sequence[str]
) -> Figure:
    rows = _rows(table, setup, "P2")
    rows = rows[(rows.evaluated_on == OVERALL) & rows.detector.isin(detectors)]
    strengths = results.strengths(setup)
    labels = [strength_name(strength) for strength in strengths]
    rows = rows[[pd.isna(s) or s in strengths for s in rows.strength]]
    rows = rows.assign(place=[_place(strengths, strength) for strength in rows.strength])
    title = "strength of the disturbance" if pd.notna(strengths[-1]) else "recordings"
    return _by_metric(rows, detectors, labels, title)


def baselines_by_scenario(results: Results, setup: str) -> Figure:
    """Draw every detector's metrics in each scenario at the greatest strength (P2)."""
    scenarios = drawn_scenarios(results, setup)
    names = list(scenarios[~scenarios.is_apart].evaluated_on)
    rows = _strongest(_rows(results.detection, setup, "P2"), results, setup)
    rows = rows[rows.evaluated_on.isin(names)]
    rows = rows.assign(place=[names.index(name) for name in rows.evaluated_on])
    return _by_metric(rows, _SHOWN, names, "", upright=False)


def protocols(results: Results, setup: str) -> Figure:
    """Draw every detector and the oracle under each protocol, at the greatest strength."""
    rows = _strongest(_rows(results.detection, setup, None), results, setup)
    rows = rows[rows.evaluated_on == OVERALL]
    names = [name for name in PROTOCOL_NAMES if name in set(rows.protocol)]
    rows = rows.assign(place=[names.index(name) for name in rows.protocol])
    # Published values stand beside two protocols in the table; they belong to the paper's.
    rows.loc[rows.protocol != "P1", "published"] = np.nan
    return _by_metric(rows, _SHOWN, [PROTOCOL_NAMES[name] for name in names], "")


def components_apart(results: Results, setup: str) -> Figure:
    """Draw what was set apart (one component of the weather, novel regimes) beside the whole."""
    scenarios = results.scenarios(setup)
    apart = list(scenarios[scenarios.is_apart].evaluated_on)
    rows = _rows(results.detection, setup, "P2")
    strengths = rows[rows.evaluated_on.isin(apart)].strength.unique()
    same = rows.strength.isin(strengths) | rows.strength.isna()
    rows = rows[same & rows.evaluated_on.isin([OVERALL, *apart])]
    order = {name: place for place, name in enumerate((OVERALL, *apart))}
    rows = rows.assign(order=rows.evaluated_on.map(order), published=np.nan)
    rows = rows.sort_values(["order", "strength"], kind="stable")
    several = len(strengths) > 1
    labels = [
        with_strength(name, strength) if several else str(name)
        for name, strength in zip(rows.evaluated_on, rows.strength, strict=True)
    ]
    names = list(dict.fromkeys(labels))
    rows = rows.assign(place=[names.index(label) for label in labels])
    at = "" if several or pd.isna(strengths[0]) else f"strength {strength_name(strengths[0])}"
    return _by_metric(rows, _SHOWN, names, at, upright=not several)


def has_components(results: Results, setup: str) -> bool:
    """Whether anything was set apart in a set-up."""
    return bool(results.scenarios(setup).is_apart.any())


def has_strengths(results: Results, setup: str) -> bool:
    """Whether anything that a set-up was judged on has a strength."""
    return bool(pd.notna(results.strengths(setup)[-1]))


def has_groups(results: Results, setup: str) -> bool:
    """Whether a set-up was judged by scenario."""
    return int((~results.scenarios(setup).is_apart).sum()) > 1


def _rows(table: pd.DataFrame, setup: str, protocol: str | None) -> pd.DataFrame:
    rows = table[(table.setup == setup) & table.metric.isin(METRICS)]
    return rows if protocol is None else rows[rows.protocol == protocol]


def _strongest(rows: pd.DataFrame, results: Results, setup: str) -> pd.DataFrame:
    return same_strength(rows, results.strengths(setup)[-1])


def _place(strengths: Sequence[float], strength: float) -> int:
    if pd.isna(strength):
        return 0
    return list(strengths).index(strength)


def _by_metric(
    rows: pd.DataFrame,
    wanted: Sequence[str],
    labels: Sequence[str],
    title: str,
    *,
    upright: bool = True,
) -> Figure:
    """Draw a panel for each metric: ``rows`` have a ``place`` on the common axis of labels."""
    detectors = [name for name in wanted if name in set(rows.detector)]
    rows = rows[rows.detector.isin(detectors)]
    with figure_style():
        if upright:
            figure = Figure(figsize=(9.6, 3.3))
            grid = figure.subplots(1, len(METRICS))
        else:
            figure = Figure(figsize=(9.6, 0.42 * len(labels) + 1.5))
            grid = figure.subplots(1, len(METRICS), sharey=True)
        for axes, metric in zip(grid, METRICS, strict=True):
            own = rows[rows.metric == metric]
            _panel(axes, own, detectors, upright=upright)
            axes.set_title(METRIC_NAMES[metric])
            _label(axes, labels, _lowest(own), upright=upright)
        _finish(figure, list(grid), title, upright=upright)
        _legend(figure, detectors, has_published=bool(rows.published.notna().any()))
    return figure


def _panel(axes: Axes, rows: pd.DataFrame, detectors: Sequence[str], *, upright: bool) -> None:
    width = 0.74 / max(1, len(detectors))
    for number, detector in enumerate(detectors):
        own = rows[(rows.detector == detector) & rows.value.notna()]
        if own.empty:
            continue
        at = own.place.to_numpy() + (number - (len(detectors) - 1) / 2) * width
        values = 100 * own.value.to_numpy()
        below = 100 * (own.value - own.ci_low.fillna(own.value)).clip(lower=0).to_numpy()
        above = 100 * (own.ci_high.fillna(own.value) - own.value).clip(lower=0).to_numpy()
        look = detector_look(detector, detectors)
        style: dict[str, Any] = {
            "fmt": look.marker,
            "color": look.colour,
            "markersize": 4.5,
            "elinewidth": 1.3,
            "capsize": 0,
        }
        published = 100 * own.published.to_numpy(dtype=float)
        hollow: dict[str, Any] = {
            "s": 46,
            "facecolor": "none",
            "edgecolor": look.colour,
            "marker": "D",
        }
        if upright:
            axes.errorbar(at, values, yerr=[below, above], **style)
            axes.scatter(at, published, **hollow)
        else:
            axes.errorbar(values, at, xerr=[below, above], **style)
            axes.scatter(published, at, **hollow)


def _lowest(rows: pd.DataFrame) -> float:
    """Return where an axis begins, in percent: a ten below all there is to see."""
    shown = rows[["value", "ci_low", "published"]].to_numpy(dtype=np.float64)
    lowest = float(np.nanmin(shown)) if np.isfinite(shown).any() else float("nan")
    return 0.0 if np.isnan(lowest) else max(0.0, min(90.0, 10 * np.floor(10 * lowest)))


def _label(axes: Axes, labels: Sequence[str], lowest: float, *, upright: bool) -> None:
    margin = 0.03 * (100 - lowest)
    shown = (lowest - margin, 100 + margin)
    if upright:
        axes.set_xticks(range(len(labels)), labels)
        axes.set_xlim(-0.55, len(labels) - 0.45)
        axes.set_ylim(shown)
        axes.grid(visible=False, axis="x")
    else:
        axes.set_yticks(range(len(labels)), labels)
        axes.set_ylim(len(labels) - 0.45, -0.55)
        axes.set_xlim(shown)
        axes.grid(visible=False, axis="y")
    borders = np.arange(len(labels) - 1) + 0.5
    for border in borders:
        line = axes.axvline if upright else axes.axhline
        line(border, color="#d0d0d0", linewidth=0.6)


def _finish(figure: Figure, grid: Sequence[Axes], title: str, *, upright: bool) -> None:
    if upright:
        grid[0].set_ylabel("percent, 95 % interval")
        if title:
            figure.supxlabel(title, fontsize=9)
    else:
        figure.supxlabel("percent, 95 % interval", fontsize=9)


def _legend(figure: Figure, detectors: Sequence[str], *, has_published: bool) -> None:
    handles = [
        Line2D(
            [],
            [],
            color=detector_look(detector, detectors).colour,
            marker=detector_look(detector, detectors).marker,
            markersize=5,
            linewidth=1.3,
            label=detector_name(detector),
        )
        for detector in detectors
    ]
    if has_published:
        handles.append(
            Line2D(
                [],
                [],
                color="black",
                marker="D",
                markerfacecolor="none",
                linewidth=0,
                markersize=6.5,
                label="published, same colour",
            )
        )
    figure.legend(handles=handles, loc="outside upper center", ncols=3)
