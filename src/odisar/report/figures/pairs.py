"""What the monitor has over each other detector, judged on the same recordings."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from odisar.report.detectors import MONITOR, detector_name
from odisar.report.load import OVERALL, Results
from odisar.report.names import METRIC_NAMES, SHARES, strength_name
from odisar.report.picking import same_strength
from odisar.report.style import figure_style

#: Metrics of the table of pairs, with what a difference above zero means.
_PANELS = {
    "auroc": "right: ODiSAR better",
    "tnr_at_tpr95": "right: ODiSAR better",
    "f1_ood": "right: ODiSAR better",
    "delay_p50_s": "left: ODiSAR sooner",
}
#: Up to here [points, s] the axis is linear, and logarithmic from there.
_LINEAR = 1.0
_WIDER = 1.6
_TICKS = (-300, -100, -30, -10, -3, -1, 0, 1, 3, 10, 30, 100, 300)
_MARKERS = ("o", "s", "^", "D", "v", "P")


def paired_differences(results: Results, setup: str) -> Figure:
    """Draw ODiSAR minus every other detector with paired intervals (P2, overall), by strength."""
    rows = pairs_of(results, setup)
    others = list(dict.fromkeys(rows.other))
    strengths = sorted(rows.strength.unique(), key=lambda value: (pd.notna(value), value))
    shades = sns.color_palette("cividis_r", len(strengths) + 1)
    colours = [to_hex(shade) for shade in shades[1:]]
    with figure_style():
        height = max(0.11 * len(strengths) + 0.08, 0.26) * len(others) + 1.5
        figure = Figure(figsize=(9.6, height))
        grid = figure.subplots(1, len(_PANELS), sharey=True)
        for axes, (metric, meaning) in zip(grid, _PANELS.items(), strict=True):
            own = rows[rows.metric == metric]
            for number, strength in enumerate(strengths):
                shift = 0.7 * ((number + 0.5) / len(strengths) - 0.5)
                look = (colours[number], _MARKERS[number % len(_MARKERS)])
                _points(axes, same_strength(own, strength), others, shift, look)
            unit = "points" if metric in SHARES else "s"
            axes.set_title(f"{METRIC_NAMES[metric].removesuffix(' [s]')} [{unit}]\n{meaning}")
            _scale(axes)
        grid[0].set_yticks(range(len(others)), [detector_name(name) for name in others])
        grid[0].set_ylim(len(others) - 0.45, -0.55)
        if len(strengths) > 1:
            _legend(figure, strengths, colours)
    return figure


def pairs_of(results: Results, setup: str) -> pd.DataFrame:
    """Return the pairs of a set-up that the report speaks of: P2, overall."""
    rows = results.paired
    rows = rows[(rows.setup == setup) & (rows.evaluated_on == OVERALL) & (rows.protocol == "P2")]
    return rows[rows.detector == MONITOR]


def has_pairs(results: Results, setup: str) -> bool:
    """Whether anything was compared."""
    return bool(pairs_of(results, setup).difference.notna().any())


def _points(
    axes: Axes, rows: pd.DataFrame, others: Sequence[str], shift: float, look: tuple[str, str]
) -> None:
    rows = rows[rows.difference.notna()]
    scale = 100 if rows.metric.isin(SHARES).any() else 1
    at = np.array([others.index(name) for name in rows.other], dtype=float) + shift
    values = scale * rows.difference.to_numpy()
    low = scale * rows.ci_low.fillna(rows.difference).to_numpy()
    high = scale * rows.ci_high.fillna(rows.difference).to_numpy()
    bars = np.clip([values - low, high - values], 0, None)
    axes.errorbar(
        values, at, xerr=bars, fmt=look[1], color=look[0], ms=4, elinewidth=1.2, mec="#333333",
        mew=0.3,
    )  # fmt: skip


def _scale(axes: Axes) -> None:
    axes.axvline(0, color="black", linewidth=0.8)
    axes.set_xscale("symlog", linthresh=_LINEAR)
    low, high = axes.get_xlim()
    # With room for a marker at either end.
    axes.set_xlim(min(_WIDER * low, -_LINEAR), max(_WIDER * high, _LINEAR))
    inside = [tick for tick in _TICKS if axes.get_xlim()[0] <= tick <= axes.get_xlim()[1]]
    # As many as the panel has room for.
    few = [tick for tick in inside if tick in (-100, -10, -1, 0, 1, 10, 100)]
    axes.xaxis.set_major_locator(FixedLocator(inside if len(inside) <= 6 else few))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.grid(visible=False, axis="y")


def _legend(figure: Figure, strengths: Sequence[float], colours: Sequence[str]) -> None:
    handles = [
        Line2D(
            [], [], color=colour, marker=_MARKERS[number % len(_MARKERS)], ms=5, mec="#333333",
            label=f"strength {strength_name(strength)}",
        )
        for number, (strength, colour) in enumerate(zip(strengths, colours, strict=True))
    ]  # fmt: skip
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles))
