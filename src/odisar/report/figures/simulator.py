"""The simulators: the vessel's against a sea trial and in standard trials, the robot's office."""

import pandas as pd
import seaborn as sns
from matplotlib.figure import Figure

from odisar.report.style import channel_label, figure_style, row_inches
from odisar.simulators.robot.plausibility import MapTraces

#: Part of the trial that is drawn: zigzags and a turning circle fit in it [s].
_SHOWN_S = (1000.0, 2600.0)

#: Part of a zigzag that is drawn: a few overshoots to each side [s].
_ZIGZAG_S = 400.0


def sea_trial(traces: pd.DataFrame) -> Figure:
    """Draw measured beside simulated states of R/V Gunnerus (``validation_traces``)."""
    shown = traces[(traces.time_s >= _SHOWN_S[0]) & (traces.time_s <= _SHOWN_S[1])]
    units = dict(zip(shown.state, shown.unit, strict=True))
    labels = [channel_label(state, unit) for state, unit in units.items()]
    with figure_style():
        figure = Figure(figsize=(8.4, row_inches(labels, 1.35) * len(units) + 0.9))
        grid = figure.subplots(len(units), 1, sharex=True)
        for axes, state, label in zip(grid, units, labels, strict=True):
            own = shown[shown.state == state]
            minutes = own.time_s / 60
            axes.plot(minutes, own.measured, color="#222222", linewidth=0.9, label="measured")
            axes.plot(minutes, own.simulated, color="#D55E00", lw=1.0, ls="--", label="simulated")
            axes.set_ylabel(label)
        grid[-1].set_xlabel("time of the trial [min]")
        handles, labels = grid[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=2)
        figure.align_ylabels()
    return figure


def standard_trials(traces: pd.DataFrame) -> Figure:
    """Draw the ferry's turning circles and zigzags in calm water (``trial_traces``)."""
    turns = traces[traces.trial == "turning"]
    zigzags = traces[(traces.trial == "zigzag") & (traces.time_s <= _ZIGZAG_S)]
    angles = sorted(traces.angle_deg.unique())
    colours = dict(zip(angles, sns.color_palette("viridis", len(angles)), strict=True))
    with figure_style():
        figure = Figure(figsize=(8.4, 3.6))
        tracks, headings = figure.subplots(1, 2, width_ratios=[1, 1.4])
        for angle in angles:
            label, colour = f"{angle:g} deg", colours[angle]
            track = turns[turns.angle_deg == angle]
            tracks.plot(track.aside, track.ahead, color=colour, linewidth=1.1)
            zigzag = zigzags[zigzags.angle_deg == angle]
            headings.plot(zigzag.time_s, zigzag.turned_deg, color=colour, lw=1.1, label=label)
        tracks.set_aspect("equal", adjustable="datalim")
        tracks.set(xlabel="to port [ship lengths]", ylabel="ahead [ship lengths]", title="turning")
        headings.set(xlabel="time [s]", ylabel="heading, to port [deg]", title="zigzag")
        figure.legend(loc="outside upper center", ncols=len(angles), title="thruster angle")
    return figure


def office_map(traces: MapTraces) -> Figure:
    """Draw the office, and the paths of a few tasks over their numbered waypoints."""
    rows, columns = traces.occupied.shape
    extent = (0.0, columns * traces.resolution_m, 0.0, rows * traces.resolution_m)
    colours = sns.color_palette("colorblind", len(traces.paths))
    with figure_style():
        figure = Figure(figsize=(8.4, 5.6))
        axes = figure.subplots()
        axes.imshow(
            traces.occupied, cmap="Greys", vmin=0, vmax=1.6, origin="lower", extent=extent,
            interpolation="nearest",
        )  # fmt: skip
        for number, (path, goals) in enumerate(zip(traces.paths, traces.waypoints, strict=True)):
            colour, label = colours[number], f"task {number + 1}"
            axes.plot(path[:, 0], path[:, 1], color=colour, linewidth=1.2, label=label)
            axes.plot(*path[0], marker="s", color=colour, markersize=5, markeredgecolor="white")
            for order, goal in enumerate(goals[1:], start=1):
                axes.annotate(
                    str(order), goal, color="white", fontsize=7, ha="center", va="center",
                    bbox={"boxstyle": "circle,pad=0.2", "facecolor": colour, "linewidth": 0},
                )  # fmt: skip
        axes.set(xlabel="x [m]", ylabel="y [m]")
        axes.grid(visible=False)
        figure.legend(loc="outside upper center", ncols=len(traces.paths))
    return figure
