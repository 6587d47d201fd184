"""What recordings look like: every channel of a disturbed and of an undisturbed one."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from odisar.report.clock import Clock, clock, shade_events, trace_of
from odisar.report.load import Results
from odisar.report.style import channel_label, figure_style, row_inches

_STATE, _COMMAND = "#0072B2", "#444444"


def recordings_overview(results: Results, case: str) -> Figure:
    """Draw all channels of the case's two examples, commands in grey, the event shaded."""
    chosen = results.examples.chosen[case]
    kinds = [kind for kind in ("disturbed", "clean") if kind in chosen]
    channels = results.config.cases[case].channels
    traces = {kind: trace_of(results, case, chosen[kind]["recording"]) for kind in kinds}
    longest_s = max(float(own.time_s.max() - own.time_s.min()) for own in traces.values())
    labels = [channel_label(channel.name, channel.unit) for channel in channels]
    with figure_style():
        figure = Figure(figsize=(4.7 * len(kinds), row_inches(labels) * len(channels) + 0.9))
        grid = figure.subplots(len(channels), len(kinds), sharey="row", sharex="col", squeeze=False)
        for column, kind in enumerate(kinds):
            example = chosen[kind]
            own = traces[kind]
            time = clock(float(own.time_s.min()), longest_s)
            for row, channel in enumerate(channels):
                axes = grid[row][column]
                _trace(axes, own[own.channel == channel.name], channel.role, time)
                shade_events(axes, example["events"], time)
                if column == 0:
                    axes.set_ylabel(labels[row])
            grid[0][column].set_title(
                f"{kind_name(kind if example['events'] else 'clean')}\n{example['recording']}"
            )
            grid[-1][column].set_xlabel(time.label)
        figure.align_ylabels()
    return figure


def kind_name(kind: str) -> str:
    """Return how a figure calls an example of this kind."""
    return {"disturbed": "disturbed (event shaded)", "clean": "undisturbed"}[kind]


def _trace(axes: Axes, samples: pd.DataFrame, role: str, time: Clock) -> None:
    colour = _COMMAND if role == "command" else _STATE
    drawn = axes.step if role == "command" else axes.plot
    drawn(time.all_at(samples.time_s), samples.value, color=colour, linewidth=0.8)
