"""Time axes: since a recording's first sample, in seconds or minutes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from odisar.report.load import Results
from odisar.report.style import EVENT_COLOUR

#: From this length on, what is shown has its axis in minutes [s].
_MINUTES_FROM_S = 180.0


@dataclass(frozen=True)
class Clock:
    """How a figure tells time: a recording's own clock may count from 1970."""

    start_s: float
    unit: str
    unit_s: float

    @property
    def label(self) -> str:
        """What stands below a time axis."""
        return f"time since start [{self.unit}]"

    def at(self, time_s: float) -> float:
        """Return the place on the axis of a time on the recording's own clock [s]."""
        return (time_s - self.start_s) / self.unit_s

    def all_at(self, times_s: ArrayLike) -> NDArray[np.float64]:
        """Return the places of many times."""
        return (np.asarray(times_s, dtype=np.float64) - self.start_s) / self.unit_s


def clock(start_s: float, shown_s: float) -> Clock:
    """Return the clock of a recording that begins at ``start_s``, of which so much is shown."""
    return Clock(start_s, *span_unit(shown_s))


def span_unit(shown_s: float) -> tuple[str, float]:
    """Return the unit in which so long a time axis is told, and its seconds."""
    return ("s", 1.0) if shown_s < _MINUTES_FROM_S else ("min", 60.0)


def trace_of(results: Results, case: str, recording: str) -> pd.DataFrame:
    """Return every channel of an example recording."""
    traces = results.examples.traces
    return traces[(traces.case == case) & (traces.recording == recording)]


def shade_events(axes: Axes, events: Sequence[tuple[float, float]], time: Clock) -> None:
    """Shade the disturbed stretches of a time axis; only the first is named in a legend."""
    for number, (start_s, end_s) in enumerate(events):
        axes.axvspan(
            time.at(start_s),
            time.at(end_s),
            color=EVENT_COLOUR,
            alpha=0.55,
            linewidth=0,
            zorder=0,
            label="event" if number == 0 else None,
        )
