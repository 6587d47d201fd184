"""The four confidence quadrants: how often, and where every window lies."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from odisar.report.load import Results
from odisar.report.names import QUADRANT_NAMES, strength_name, with_strength
from odisar.report.picking import drawn_scenarios
from odisar.report.style import (
    QUADRANT_COLOURS,
    QUADRANT_HATCHES,
    QUADRANTS,
    figure_style,
    plain_logarithm,
)

#: Shares below this are too narrow to carry their number.
_SHOWN_SHARE = 0.07
_POINTS_EACH = 4000
#: Share of scenarios that must exist at each strength for a panel a strength to be worth it.
_DENSE = 0.6


def quadrant_distribution(results: Results, setup: str) -> Figure:
    """Draw the share of windows in each quadrant, by scenario and strength (the paper's RQ2)."""
    table = results.quadrants[results.quadrants.setup == setup]
    scenarios = list(drawn_scenarios(results, setup).evaluated_on)
    panels = _panels(table[table.evaluated_on.isin(scenarios)], scenarios)
    rows = panels[0].rows
    published = _published(table)
    columns = len(panels) + (published is not None)
    with figure_style():
        figure = Figure(figsize=(max(2.3 * columns + 1.4, 6.8), 0.3 * len(rows) + 1.7))
        grid = figure.subplots(1, columns, sharey=True, squeeze=False)[0]
        for axes, panel in zip(grid, panels, strict=False):
            _bars(axes, panel.table, rows)
            axes.set_title(panel.title)
        if published is not None:
            _published_ranges(grid[-1], published, len(rows))
        grid[0].set_yticks(range(len(rows)), rows)
        grid[0].set_ylim(len(rows) - 0.4, -0.6)
        figure.supxlabel("share of assessed windows of disturbed recordings [%]", fontsize=9)
        _legend(figure)
    return figure


def has_quadrants(results: Results, setup: str) -> bool:
    """Whether any window of a disturbed recording was assessed."""
    return bool((results.quadrants.setup == setup).any())


@dataclass(frozen=True)
class _Panel:
    """Shares by ``row`` and quadrant under one title."""

    title: str
    rows: list[str]
    table: pd.DataFrame


def _panels(table: pd.DataFrame, scenarios: list[str]) -> list[_Panel]:
    """Return a panel for each strength; one for all where most scenarios have their own."""
    strengths = sorted(table.strength.unique(), key=lambda value: (pd.notna(value), value))
    cells = table[["evaluated_on", "strength"]].drop_duplicates()
    if len(cells) >= _DENSE * len(scenarios) * len(strengths):
        named = table.assign(row=table.evaluated_on)
        return [
            _Panel(
                "" if pd.isna(strength) else f"strength {strength_name(strength)}",
                scenarios,
                named[named.strength.isna() if pd.isna(strength) else named.strength == strength],
            )
            for strength in strengths
        ]
    named = table.assign(
        row=[
            with_strength(name, strength)
            for name, strength in zip(table.evaluated_on, table.strength, strict=True)
        ]
    )
    order = {name: place for place, name in enumerate(scenarios)}
    ordered = named.assign(place=named.evaluated_on.map(order)).sort_values(["place", "strength"])
    return [_Panel("", list(dict.fromkeys(ordered.row)), named)]


def _bars(axes: Axes, table: pd.DataFrame, scenarios: Sequence[str]) -> None:
    shares = table.pivot_table(index="row", columns="quadrant", values="share")
    shares = shares.reindex(index=list(scenarios), columns=list(QUADRANTS))
    left = np.zeros(len(scenarios))
    for quadrant in QUADRANTS:
        width = shares[quadrant].fillna(0).to_numpy()
        axes.barh(
            np.arange(len(scenarios)),
            100 * width,
            left=100 * left,
            height=0.78,
            color=QUADRANT_COLOURS[quadrant],
            hatch=QUADRANT_HATCHES[quadrant],
            edgecolor="white",
            linewidth=0.3,
        )
        for row, share in enumerate(width):
            if share >= _SHOWN_SHARE:
                _number(axes, 100 * (left[row] + share / 2), row, share)
        left += width
    for empty in np.flatnonzero(shares.isna().all(axis=1).to_numpy()):
        axes.text(
            50, int(empty), "not recorded", ha="center", va="center", color="#999999", fontsize=7
        )
    axes.set_xlim(0, 100)
    axes.grid(visible=False, axis="y")


def _number(axes: Axes, x: float, y: float, share: float) -> None:
    box = {"facecolor": "white", "alpha": 0.8, "linewidth": 0, "boxstyle": "round,pad=0.12"}
    axes.text(x, y, f"{100 * share:.0f}", ha="center", va="center", fontsize=6.5, bbox=box)


def _published(table: pd.DataFrame) -> pd.DataFrame | None:
    known = table[table.published.notna() & (table.published.astype(str) != "")]
    if known.empty:
        return None
    return known.drop_duplicates("quadrant").set_index("quadrant")


def _published_ranges(axes: Axes, published: pd.DataFrame, rows: int) -> None:
    """Draw what the paper's text states as ranges: it prints no numbers in its figure."""
    places = np.linspace(0, rows - 1, len(QUADRANTS))
    height = min(1.0, 0.6 * rows / len(QUADRANTS))
    for place, quadrant in zip(places, QUADRANTS, strict=True):
        if quadrant not in published.index:
            axes.text(
                50, place, "not stated", ha="center", va="center", color="#777777", fontsize=7
            )
            continue
        row: Any = published.loc[quadrant]
        low, high = 100 * float(row.published_low), 100 * float(row.published_high)
        axes.barh(
            place,
            max(high - low, 1.0),
            left=low,
            height=height,
            color=QUADRANT_COLOURS[quadrant],
            hatch=QUADRANT_HATCHES[quadrant],
            edgecolor="black",
            linewidth=0.6,
        )
        text = f"{low:.0f}-{high:.0f}" if high > low else f"{low:.0f}"
        beside = (high + 3, "left") if high < 70 else (low - 3, "right")
        axes.text(beside[0], place, text, ha=beside[1], va="center", fontsize=7)
    axes.set_xlim(0, 100)
    axes.grid(visible=False, axis="y")
    axes.set_title("published (ranges)")


def _legend(figure: Figure) -> None:
    handles = [
        Patch(
            facecolor=QUADRANT_COLOURS[quadrant],
            hatch=QUADRANT_HATCHES[quadrant],
            edgecolor="white",
            label=QUADRANT_NAMES[quadrant],
        )
        for quadrant in QUADRANTS
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4)


def quadrant_scatter(results: Results, setup: str) -> Figure:
    """Draw score against variance of every assessed window, thresholds as lines.

    With several members, each with thresholds of its own, both axes are multiples of them.
    """
    windows = results.assessments(setup)
    limits = results.limits(setup)
    if len(limits) == 1:
        columns = ("score", "uncertainty_variance")
        thresholds = next(iter(limits.values()))["thresholds"]
        lines = (thresholds["score"], thresholds["variance"])
        names = ("score (1: usual)", "predictive variance [scaled units$^2$]")
    else:
        columns, lines = ("score_ratio", "variance_ratio"), (1.0, 1.0)
        names = (
            "score [multiples of its threshold]",
            "predictive variance\n[multiples of its threshold]",
        )
    with figure_style():
        figure = Figure(figsize=(7.6, 3.9))
        grid = figure.subplots(1, 2, sharex=True, sharey=True)
        for axes, disturbed in zip(grid, (False, True), strict=True):
            chosen = windows[windows.is_disturbed == disturbed]
            _points(axes, chosen, columns)
            axes.axvline(lines[0], color="black", linewidth=1.0, linestyle="--")
            axes.axhline(lines[1], color="black", linewidth=1.0, linestyle=":")
            title = "disturbance active" if disturbed else "undisturbed"
            axes.set_title(f"{title}: {len(chosen)} windows")
        grid[0].set_xscale("log")
        grid[0].set_yscale("log")
        for axis in (grid[0].xaxis, grid[0].yaxis):
            plain_logarithm(axis)
        grid[0].set_ylabel(names[1])
        figure.supxlabel(names[0] + "; dashed and dotted: thresholds", fontsize=9)
        _legend(figure)
    return figure


def _points(axes: Axes, windows: pd.DataFrame, columns: tuple[str, str]) -> None:
    # Rarest on top. Evenly thinned where there are more points than a print can show.
    markers = {"green": "o", "yellow": "s", "orange": "^", "red": "X"}
    for quadrant in QUADRANTS:
        chosen = windows[windows.category == quadrant]
        chosen = chosen.iloc[:: max(1, len(chosen) // _POINTS_EACH)]
        axes.scatter(
            chosen[columns[0]],
            chosen[columns[1]],
            s=13,
            marker=markers[quadrant],
            color=QUADRANT_COLOURS[quadrant],
            edgecolor="#333333",
            linewidth=0.25,
            alpha=0.75,
        )
