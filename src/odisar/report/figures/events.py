"""One event from the inside: forecasts, the score over time, and the states it blames."""

import json
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from odisar.evaluation.alarms import alarm_times
from odisar.report.clock import Clock, clock, shade_events, trace_of
from odisar.report.detectors import MONITOR
from odisar.report.judged import judged_recording
from odisar.report.load import Results, rows_of
from odisar.report.names import with_strength
from odisar.report.ordering import fault_key
from odisar.report.picking import drawn_scenarios
from odisar.report.style import (
    EVENT_COLOUR,
    QUADRANT_COLOURS,
    QUADRANT_HATCHES,
    channel_label,
    figure_style,
    row_inches,
)

#: Height of a state's row of blamed windows, with room for its name.
_STATE_INCHES = 0.22
_FORECAST, _RECONSTRUCTION, _TRUTH = "#D55E00", "#009E73", "#222222"


def forecast_examples(results: Results, setup: str) -> Figure:
    """Draw forecasts on the disturbed example beside what came true, in physical units."""
    case = results.config.setups[setup].case
    example = results.examples.chosen[case]["disturbed"]
    forecasts = results.examples.forecasts
    forecasts = forecasts[forecasts.setup == setup]
    states = list(dict.fromkeys(forecasts.state))
    issued = sorted(forecasts.issued_s.unique())
    traces = trace_of(results, case, example["recording"])
    window = results.case_of(setup).window
    rate_hz = results.case_of(setup).rate_hz
    context_s = window.context_steps / rate_hz
    time = clock(float(traces.time_s.min()), context_s + window.horizon_steps / rate_hz)
    labels = [channel_label(state, example["units"][state]) for state in states]
    with figure_style():
        height = row_inches(labels, 1.15) * len(states) + 1.2
        figure = Figure(figsize=(max(3.2 * len(issued) + 0.5, 6.8), height))
        grid = figure.subplots(len(states), len(issued), sharey="row", sharex="col", squeeze=False)
        for column, issued_s in enumerate(issued):
            here = forecasts[forecasts.issued_s == issued_s]
            for row, state in enumerate(states):
                axes = grid[row][column]
                trace = traces[(traces.channel == state) & (traces.time_s >= issued_s - context_s)]
                trace = trace[trace.time_s <= here.time_s.max()]
                _forecast(axes, here[here.state == state], trace, issued_s, time)
                shade_events(axes, _inside(example["events"], trace), time)
                if column == 0:
                    axes.set_ylabel(labels[row])
            axes.set_xlim(time.at(issued_s - context_s), time.at(float(here.time_s.max())))
            grid[0][column].set_title(f"issued at {time.at(issued_s):.1f} {time.unit}")
            grid[-1][column].set_xlabel(time.label)
        figure.align_ylabels()
        _forecast_legend(figure)
    return figure


def _inside(events: list[list[float]], trace: pd.DataFrame) -> list[tuple[float, float]]:
    first, last = float(trace.time_s.min()), float(trace.time_s.max())
    cut = [(max(start, first), min(end, last)) for start, end in events]
    return [(start, end) for start, end in cut if end > start]


def _forecast(
    axes: Axes, forecast: pd.DataFrame, trace: pd.DataFrame, issued_s: float, time: Clock
) -> None:
    ahead = time.all_at(forecast.time_s)
    axes.plot(time.all_at(trace.time_s), trace.value, color=_TRUTH, linewidth=0.8)
    axes.fill_between(ahead, forecast.low, forecast.high, color=_FORECAST, alpha=0.25, linewidth=0)
    axes.plot(ahead, forecast.forecast, color=_FORECAST, linewidth=1.3)
    axes.plot(ahead, forecast.reconstruction, color=_RECONSTRUCTION, linewidth=1.1, ls="--")
    axes.axvline(time.at(issued_s), color="black", linewidth=0.7, linestyle=":")


def _forecast_legend(figure: Figure) -> None:
    handles = [
        Line2D([], [], color=_TRUTH, linewidth=0.9, label="recorded"),
        Line2D([], [], color=_FORECAST, linewidth=1.3, label="forecast"),
        Patch(facecolor=_FORECAST, alpha=0.25, label="5-95 % of Monte Carlo draws"),
        Line2D([], [], color=_RECONSTRUCTION, ls="--", label="reconstruction of the forecast"),
        Patch(facecolor=EVENT_COLOUR, alpha=0.55, label="event"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3)


def event_attribution(results: Results, setup: str) -> Figure:
    """Draw the score over the disturbed example and the states blamed in its flagged windows."""
    case = results.config.setups[setup].case
    example = results.examples.chosen[case]["disturbed"]
    scores = results.scores(setup)
    scores = scores[scores.recording == example["recording"]]
    known = results.examples.recordings
    member = known[(known.setup == setup) & (known.recording == example["recording"])].member.iloc[
        0
    ]
    limits = results.limits(setup)[member]
    windows = results.assessments(setup)
    windows = windows[windows.recording == example["recording"]]
    start_s = float(trace_of(results, case, example["recording"]).time_s.min())
    time = clock(start_s, float(scores.time_s.max() - scores.time_s.min()))
    states = results.case_of(setup).blamed_names
    heights = (2.4, 0.3, max(1.6, _STATE_INCHES * len(states)))
    with figure_style():
        figure = Figure(figsize=(8.4, sum(heights) + 0.3))
        score, strip, blame = figure.subplots(
            3, 1, sharex=True, gridspec_kw={"height_ratios": heights}
        )
        _score(score, scores, limits, time)
        shade_events(score, example["events"], time)
        judged = judged_recording(results, setup, example["recording"])
        persistence_s = results.case_of(setup).persistence_s
        for number, alarm_s in enumerate(alarm_times(judged, MONITOR, persistence_s)):
            label = None if number else "alarm"
            score.axvline(time.at(float(alarm_s)), color="#D55E00", lw=1.0, label=label)
        score.legend(loc="upper left", ncols=5)
        score.set_title(f"{example['recording']}, set-up {setup}")
        _quadrant_strip(strip, windows, time)
        _blame(blame, windows, states, time)
        blame.set_xlabel(time.label)
    return figure


def _score(axes: Axes, scores: pd.DataFrame, limits: dict[str, Any], time: Clock) -> None:
    """Draw the score and both thresholds; logarithmic, as the score is compared by ratios."""
    own, threshold = scores[MONITOR], limits["thresholds"]["score"]
    alarm = limits["operating"][MONITOR]
    axes.plot(time.all_at(scores.time_s), own, color="#0072B2", linewidth=0.9, label="score")
    axes.axhline(threshold, color="black", ls="--", lw=0.9, label="threshold")
    axes.axhline(alarm, color="#777777", ls=":", lw=1.1, label="alarm threshold")
    axes.set_ylabel("score\n(1: usual)")
    axes.set_yscale("log")
    low, high = min(float(own.min()), threshold), max(float(own.max()), threshold, alarm)
    # Room for the legend above all of it.
    axes.set_ylim(low / 1.15, high * (high / low) ** 0.22)


def _quadrant_strip(axes: Axes, windows: pd.DataFrame, time: Clock) -> None:
    for row in rows_of(windows):
        axes.axvspan(
            time.at(row.issued_s),
            time.at(row.end_s),
            facecolor=QUADRANT_COLOURS[row.category],
            hatch=QUADRANT_HATCHES[row.category],
            edgecolor="white",
            linewidth=0.3,
        )
    axes.set_yticks([])
    axes.set_ylabel("quadrant", rotation=0, ha="right", va="center")
    axes.grid(visible=False)


def _blame(axes: Axes, windows: pd.DataFrame, states: list[str], time: Clock) -> None:
    """Draw a cell for each blamed state and window, darker for the more abnormal."""
    values = np.full((len(states), len(windows)), np.nan)
    for column, blamed in enumerate(windows.state_attribution):
        for state, error in blamed.items():
            values[states.index(state), column] = error
    if len(windows):
        edges_s = np.append(windows.issued_s, windows.end_s.iloc[-1])
        mesh = axes.pcolormesh(
            time.all_at(edges_s),
            np.arange(len(states) + 1) - 0.5,
            np.ma.masked_invalid(values),
            cmap="cividis_r",
        )
        if np.isfinite(values).any():
            axes.figure.colorbar(
                mesh, ax=axes, label="explained by state\n[standard deviations]", pad=0.01
            )
        else:
            centre: dict[str, Any] = {"ha": "center", "va": "center", "color": "#777777"}
            axes.text(0.5, 0.5, "no window was flagged", transform=axes.transAxes, **centre)
    axes.set_yticks(range(len(states)), states)
    axes.set_ylim(len(states) - 0.5, -0.5)
    axes.grid(visible=False)


def attribution_shares(results: Results, setup: str) -> Figure:
    """Draw how often each state comes first and among the first three, at the greatest strength."""
    table = results.attribution[results.attribution.setup == setup]
    strongest = results.strengths(setup)[-1]
    same = table.strength.isna() if pd.isna(strongest) else table.strength == strongest
    scenarios = drawn_scenarios(results, setup)
    apart = list(scenarios[scenarios.is_apart].evaluated_on)
    table = table[same | table.evaluated_on.isin(apart)]
    table = table[table.evaluated_on.isin(scenarios.evaluated_on)]
    order = {name: place for place, name in enumerate(scenarios.evaluated_on)}
    table = table.assign(
        place=table.evaluated_on.map(order),
        row=[
            with_strength(name, strength)
            for name, strength in zip(table.evaluated_on, table.strength, strict=True)
        ],
    ).sort_values(["place", "strength"], kind="stable")
    names = list(dict.fromkeys(table.row))
    states = [name for name in results.case_of(setup).blamed_names if name in set(table.state)]
    with figure_style():
        figure = Figure(figsize=(8.4, 0.3 * max(len(names), 2) + 1.6))
        grid = figure.subplots(1, 2, sharey=True)
        for axes, column, title in zip(
            grid, ("top_1", "top_3"), ("named first", "among the first three"), strict=True
        ):
            shares = table.pivot_table(index="row", columns="state", values=column)
            _heat(axes, 100 * shares.reindex(index=names, columns=states))
            axes.set_title(f"{title} [% of flagged windows]")
    return figure


def _heat(axes: Axes, shares: pd.DataFrame) -> None:
    values = shares.to_numpy(dtype=float)
    axes.imshow(values, aspect="auto", cmap="Blues", vmin=0, vmax=100)
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = "white" if value > 60 else "black"
            axes.text(column, row, f"{value:.0f}", ha="center", va="center", color=colour, size=7)
    axes.set_xticks(range(values.shape[1]), list(shares.columns), rotation=20, ha="right")
    axes.set_yticks(range(values.shape[0]), list(shares.index))
    axes.grid(visible=False)


def has_flagged(results: Results, setup: str) -> bool:
    """Whether any window of a set-up was flagged, so that there is something to attribute."""
    return bool((results.attribution.setup == setup).any())


def has_faults(results: Results, setup: str) -> bool:
    """Whether a set-up was judged on injected sensor faults."""
    return results.case_of(setup).faults is not None


def fault_heat_map(results: Results, setup: str) -> Figure:
    """Draw the share of faulty time above the threshold, by kind, size and channel of the fault."""
    shares = fault_shares(results, setup)
    with figure_style():
        figure = Figure(figsize=(7.0, 0.3 * len(shares) + 1.3))
        axes = figure.subplots()
        _heat(axes, 100 * shares)
        axes.set_title("faulty seconds with a score above the threshold [%]")
        axes.set_ylabel("fault and size")
        axes.set_xlabel("faulty channel")
    return figure


def fault_shares(results: Results, setup: str) -> pd.DataFrame:
    """Return the flagged share of faulty time: rows kind and size, columns channel."""
    known = results.examples.recordings
    known = known[(known.setup == setup) & known.is_disturbed & (known.fault_channel != "")]
    limits = results.limits(setup)
    scores = dict(list(results.scores(setup).groupby("recording", sort=False)))
    rows = []
    for one in rows_of(known):
        own = scores[one.recording]
        active = pd.Series(data=False, index=own.index)
        for start, end in json.loads(str(one.events)):
            active |= (own.time_s >= start) & (own.time_s < end)
        flagged = own[MONITOR][active] > limits[one.member]["thresholds"]["score"]
        rows.append(
            (one.disturbance, one.fault_size, one.fault_channel, flagged.sum(), active.sum())
        )
    table = pd.DataFrame(rows, columns=["kind", "size", "channel", "flagged", "seconds"])
    table["fault"] = [f"{row.kind} {row.size}".strip() for row in rows_of(table)]
    summed = table.groupby(["fault", "channel"], sort=True)[["flagged", "seconds"]].sum()
    return (
        (summed.flagged / summed.seconds)
        .rename("share")
        .reset_index()
        .pivot_table(index="fault", columns="channel", values="share")
        .reindex(sorted(set(table.fault), key=fault_key))
    )
