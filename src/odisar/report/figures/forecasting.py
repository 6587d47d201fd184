"""How well the horizon is forecast, step by step, beside other forecasters."""

from collections.abc import Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from odisar.report.load import Results
from odisar.report.style import figure_style

ALL_STATES, ALL_STEPS = "all", 0
#: The commands of the horizon were not given to the forecasters.
_UNKNOWN = "unknown"
TWIN = "twin"
FORECASTER_NAMES = {
    TWIN: "the twin",
    "paper-transformer": "Transformer, paper's parameters",
    "transformer": "Transformer, plain loss",
    "weighed-transformer": "Transformer, weighed loss (the twin's)",
    "residual-transformer": "Transformer on a closed form",
    "closed-form": "closed form of the horizon",
    "persistence": "persistence",
    "constant-velocity": "constant velocity",
    "gru": "GRU",
    "patch-ts-mixer": "PatchTSMixer",
    "rnn": "LSTM",
    "vae": "VAE",
    "gan": "GAN",
}
# Okabe and Ito (2008), then Tol's muted scheme; markers and dashes besides.
_COLOURS = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#E69F00",
    "#CC79A7",
    "#56B4E9",
    "#332288",
    "#882255",
    "#999933",
    "#555555",
)
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")
_ACROSS = 3


def has_forecasts(results: Results, setup: str) -> bool:
    """Whether undisturbed test recordings hold windows to forecast."""
    return bool((results.forecast.setup == setup).any())


def has_studied_forecasts(results: Results, setup: str) -> bool:
    """Whether the study has judged forecasts of this set-up."""
    table = results.study("forecast")
    return table is not None and bool((table.setup == setup).any())


def error_by_step(results: Results, setup: str) -> Figure:
    """Draw the twin's error over the steps ahead, beside forecasters that know as much as it."""
    table = results.forecast[results.forecast.setup == setup]
    known = table[table.forecaster == TWIN].commands
    return _drawn(results, setup, table[table.commands.isin(known)])


def studied_error_by_step(results: Results, setup: str) -> Figure:
    """Draw the same of every forecaster of the study.

    Of those that do not know the commands of the horizon, unless all of them do: that is how the
    twin is run.
    """
    table = results.study("forecast")
    assert table is not None  # noqa: S101 (has_studied_forecasts has looked)
    table = table[table.setup == setup]
    unknown = table[table.commands == _UNKNOWN]
    return _drawn(results, setup, table if unknown.empty else unknown)


def _drawn(results: Results, setup: str, table: pd.DataFrame) -> Figure:
    """Draw each forecaster's error over the steps ahead: all states, and each in its unit."""
    table = table[table.step != ALL_STEPS]
    states = sorted(table.state.unique(), key=lambda state: state != ALL_STATES)
    forecasters = list(dict.fromkeys(table.forecaster))
    units = {channel.name: channel.unit for channel in results.case_of(setup).channels}
    across = min(_ACROSS, len(states))
    down = -(-len(states) // across)
    with figure_style():
        figure = Figure(figsize=(max(3.1 * across, 6.8), 2.3 * down + 0.9))
        grid = figure.subplots(down, across, squeeze=False, sharex=True).ravel()
        for axes, state in zip(grid, states, strict=False):
            own = table[table.state == state]
            _lines(axes, own, forecasters, 1 / results.case_of(setup).rate_hz)
            whole = state == ALL_STATES
            axes.set_title("all states [scaled]" if whole else _titled(state, units))
            axes.set_ylim(bottom=0)
        for axes in grid[len(states) :]:
            axes.set_visible(False)
        figure.supxlabel("seconds ahead", fontsize=9)
        figure.supylabel("root mean square error", fontsize=9)
        _legend(figure, forecasters)
    return figure


def forecaster_name(forecaster: str) -> str:
    """Return a forecaster's name for a legend."""
    return FORECASTER_NAMES.get(forecaster, forecaster)


def _titled(state: str, units: dict[str, str]) -> str:
    return f"{state} [{units[state]}]" if state in units else state


def _lines(axes: Axes, rows: pd.DataFrame, forecasters: Sequence[str], step_s: float) -> None:
    physical = "rmse_physical" in rows and rows.rmse_physical.notna().all()
    for name, own in rows.groupby("forecaster", sort=False):
        place = forecasters.index(str(name))
        ordered = own.sort_values("step")
        errors = ordered.rmse_physical if physical else ordered.rmse
        axes.plot(
            step_s * ordered.step,
            errors,
            color=_COLOURS[place % len(_COLOURS)],
            marker=_MARKERS[place % len(_MARKERS)],
            markersize=3.5,
            linewidth=1.1,
            markevery=max(1, len(ordered) // 8),
        )


def _legend(figure: Figure, forecasters: Sequence[str]) -> None:
    handles = [
        Line2D(
            [], [], color=_COLOURS[place % len(_COLOURS)], marker=_MARKERS[place % len(_MARKERS)],
            ms=4, lw=1.1, label=forecaster_name(name),
        )
        for place, name in enumerate(forecasters)
    ]  # fmt: skip
    figure.legend(handles=handles, loc="outside upper center", ncols=3)
