"""The vessel simulator held against a sea trial."""

import pandas as pd
from matplotlib.figure import Figure

from odisar.report.style import figure_style

#: Part of the trial that is drawn: zigzags and a turning circle fit in it [s].
_SHOWN_S = (1000.0, 2600.0)


def sea_trial(traces: pd.DataFrame) -> Figure:
    """Draw measured beside simulated states of R/V Gunnerus (``validation_traces``)."""
    shown = traces[(traces.time_s >= _SHOWN_S[0]) & (traces.time_s <= _SHOWN_S[1])]
    states = list(dict.fromkeys(shown.state))
    with figure_style():
        figure = Figure(figsize=(8.4, 1.35 * len(states) + 0.9))
        grid = figure.subplots(len(states), 1, sharex=True)
        for axes, state in zip(grid, states, strict=True):
            own = shown[shown.state == state]
            minutes = own.time_s / 60
            axes.plot(minutes, own.measured, color="#222222", linewidth=0.9, label="measured")
            axes.plot(minutes, own.simulated, color="#D55E00", lw=1.0, ls="--", label="simulated")
            axes.set_ylabel(f"{state.replace(' ', chr(10), 1)}\n[{own.unit.iloc[0]}]")
        grid[-1].set_xlabel("time of the trial [min]")
        handles, labels = grid[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=2)
        figure.align_ylabels()
    return figure
