"""Whether the channel that a fault was put on is the one that is named."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from odisar.report.detectors import detector_look, detector_name
from odisar.report.load import Results
from odisar.report.ordering import fault_key
from odisar.report.style import figure_style

#: All faults, or all channels, together, as the table calls them.
ANY = "any"
_CHANCE = "#777777"


def has_blame(results: Results, setup: str) -> bool:
    """Whether the guilty channel was known in any flagged window."""
    return bool((results.blame.setup == setup).any())


def guilty_channel(results: Results, setup: str) -> Figure:
    """Draw how often the guilty channel is named first, or among three, beside chance."""
    table = results.blame[results.blame.setup == setup]
    table = table[table.guilty == ANY]
    faults = sorted(set(table.fault) - {ANY}, key=fault_key)
    names = [ANY, *faults]
    attributions = list(dict.fromkeys(table.attribution))
    with figure_style():
        figure = Figure(figsize=(8.4, 0.34 * len(names) + 1.4))
        grid = figure.subplots(1, 2, sharey=True)
        for axes, top, title in zip(
            grid, (1, 3), ("named first", "among the first three"), strict=True
        ):
            for number, attribution in enumerate(attributions):
                shift = 0.5 * ((number + 0.5) / len(attributions) - 0.5)
                own = table[table.attribution == attribution]
                _points(axes, own, names, top, attribution, shift)
            axes.set_title(f"{title} [% of flagged windows in a fault]")
            axes.set_xlim(-3, 103)
            axes.grid(visible=False, axis="y")
        counts = table[table.attribution == attributions[0]].set_index("fault").windows
        labels = [f"{_fault_name(name)} ({counts.get(name, 0)})" for name in names]
        grid[0].set_yticks(range(len(names)), labels)
        grid[0].set_ylim(len(names) - 0.4, -0.6)
        grid[0].set_ylabel("fault (flagged windows)")
        _legend(figure, attributions)
    return figure


def _fault_name(name: str) -> str:
    return "all faults" if name == ANY else name


def _points(
    axes: Axes, rows: pd.DataFrame, names: list[str], top: int, attribution: str, shift: float
) -> None:
    look = detector_look(attribution, ())
    at = np.array([names.index(name) for name in rows.fault], dtype=float) + shift
    hit = 100 * rows[f"hit_{top}"].to_numpy()
    low = 100 * rows[f"hit_{top}_low"].fillna(rows[f"hit_{top}"]).to_numpy()
    high = 100 * rows[f"hit_{top}_high"].fillna(rows[f"hit_{top}"]).to_numpy()
    bars = np.clip([hit - low, high - hit], 0, None)
    axes.errorbar(hit, at, xerr=bars, fmt=look.marker, color=look.colour, ms=4.5, elinewidth=1.3)
    axes.plot(100 * rows[f"chance_{top}"], at, "|", color=_CHANCE, ms=9, mew=1.6)


def _legend(figure: Figure, attributions: list[str]) -> None:
    handles = []
    for name in attributions:
        look = detector_look(name, ())
        label = f"blame by {detector_name(name)}"
        handles.append(Line2D([], [], color=look.colour, marker=look.marker, label=label))
    chance = Line2D([], [], color=_CHANCE, ls="", marker="|", ms=9, mew=1.6, label="by chance")
    figure.legend(handles=[*handles, chance], loc="outside upper center", ncols=3)
