"""How far the forecasts' distributions can be trusted, before and after recalibration."""

from collections.abc import Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from odisar.report.load import Results
from odisar.report.style import figure_style

#: All states together, as the tables call them.
ALL_STATES = "all"
DISTRIBUTION_NAMES = {
    "draws": "Monte Carlo draws alone",
    "draws-plus-noise": "draws and noise floor",
    "recalibrated": "recalibrated",
}
_LOOKS = {
    "draws": ("#D55E00", "^", "--"),
    "draws-plus-noise": ("#E69F00", "s", "-."),
    "recalibrated": ("#0072B2", "o", "-"),
}
_ACROSS = 3


def reliability_diagram(results: Results, setup: str) -> Figure:
    """Draw how often truths lie below each forecast quantile, for all states and each of them."""
    curves = results.reliability_curves
    curves = curves[curves.setup == setup]
    states = sorted(curves.state.unique(), key=lambda state: state != ALL_STATES)
    across = min(_ACROSS, len(states))
    down = -(-len(states) // across)
    with figure_style():
        figure = Figure(figsize=(max(2.7 * across, 6.8), 2.6 * down + 0.6))
        grid = figure.subplots(down, across, squeeze=False, sharex=True, sharey=True).ravel()
        for axes, state in zip(grid, states, strict=False):
            _curves(axes, curves[curves.state == state])
            axes.set_title("all states" if state == ALL_STATES else state)
        for axes in grid[len(states) :]:
            axes.set_visible(False)
        grid[0].set(xlim=(0, 100), ylim=(0, 100))
        figure.supxlabel("quantile of the forecast [%]", fontsize=9)
        figure.supylabel("truths at or below it [%], 95 % interval", fontsize=9)
        _legend(figure, list(curves.distribution.unique()))
    return figure


def _curves(axes: Axes, curves: pd.DataFrame) -> None:
    axes.plot([0, 100], [0, 100], color="#777777", linestyle=":", linewidth=0.9)
    for name, own in curves.groupby("distribution", sort=False):
        colour, marker, style = _LOOKS[str(name)]
        level = 100 * own.level
        axes.fill_between(
            level, 100 * own.ci_low, 100 * own.ci_high, color=colour, alpha=0.2, linewidth=0
        )
        axes.plot(
            level, 100 * own.observed, color=colour, ls=style, marker=marker, ms=3.5, lw=1.1,
            markevery=2,
        )  # fmt: skip
    axes.set_aspect("equal")


def _legend(figure: Figure, distributions: Sequence[str]) -> None:
    handles = []
    for name in distributions:
        colour, marker, style = _LOOKS[name]
        label = DISTRIBUTION_NAMES[name]
        handles.append(Line2D([], [], color=colour, marker=marker, ls=style, ms=4, label=label))
    handles.append(Line2D([], [], color="#777777", ls=":", label="as promised"))
    figure.legend(handles=handles, loc="outside upper center", ncols=4)
