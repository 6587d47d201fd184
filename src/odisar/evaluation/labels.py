"""Labels: what was true at a time, or would become true within the horizon."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.evaluation.scored import rounded_times
from odisar.recordings.schema import Interval, label_times


@dataclass(frozen=True)
class Event:
    """One disturbance from onset to end: disturbed where ``onset_s <= time < end_s``."""

    onset_s: float
    end_s: float


def merge_events(intervals: Sequence[Interval]) -> list[Event]:
    """Return the events in order of time; intervals that touch or overlap are one event."""
    events: list[Event] = []
    for interval in sorted(intervals, key=lambda item: (item.start_s, item.end_s)):
        if events and interval.start_s <= events[-1].end_s:
            last = events.pop()
            events.append(Event(last.onset_s, max(last.end_s, interval.end_s)))
        else:
            events.append(Event(interval.start_s, interval.end_s))
    return events


def label_active(time_s: NDArray[np.float64], intervals: Sequence[Interval]) -> NDArray[np.bool_]:
    """Return True, in the shape of ``time_s``, where a disturbance is active at that time."""
    return label_times(rounded_times(time_s).ravel(), intervals).reshape(time_s.shape)


def label_upcoming(
    time_s: NDArray[np.float64], intervals: Sequence[Interval], horizon_steps: int, step_s: float
) -> NDArray[np.bool_]:
    """Return (time,) True where any of the next ``horizon_steps`` steps is disturbed.

    The present is not part of it: the label of time t looks at t + 1 step .. t + h steps.
    """
    first_s = rounded_times(time_s + step_s)
    last_s = rounded_times(time_s + horizon_steps * step_s)
    labels = np.zeros(len(time_s), dtype=bool)
    for interval in intervals:
        labels |= (interval.start_s <= last_s) & (first_s < interval.end_s)
    return labels


def keep_outside_guards(
    time_s: NDArray[np.float64],
    intervals: Sequence[Interval],
    guard_start_s: float,
    guard_end_s: float,
) -> NDArray[np.bool_]:
    """Return (time,) False in the first part of an event and in the time after its end.

    Physics takes time to rise and to fade: in these stretches the label is a convention.
    """
    time_s = rounded_times(time_s)
    keep = np.ones(len(time_s), dtype=bool)
    for event in merge_events(intervals):
        rising = (time_s >= event.onset_s) & (time_s < event.onset_s + guard_start_s)
        fading = (time_s >= event.end_s) & (time_s < event.end_s + guard_end_s)
        keep &= ~(rising | fading)
    return keep
