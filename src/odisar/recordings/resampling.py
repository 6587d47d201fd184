"""Put a recording on a regular grid without looking ahead: each grid sample holds the last one."""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

# The same moment, written or added up in two ways, differs by rounding: this share of a period.
_SLACK = 1e-6


def hold_on_grid(
    time_s: NDArray[np.float64], values: NDArray[np.float64], rate_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times (step,) and values (step, column) on the grid of ``rate_hz``.

    ``time_s`` (sample,) in seconds must rise; ``values`` is (sample, column). The grid starts at
    the first sample and ends at the last grid time that a sample reaches. Each step holds the
    last sample at or before it (up to a millionth of a period, for rounding), so that no step
    depends on a later sample.
    """
    if len(time_s) == 0:
        return time_s.copy(), values.copy()
    since_s = time_s - time_s[0]
    steps = np.arange(grid_steps(time_s, rate_hz))
    held = np.searchsorted(since_s, (steps + _SLACK) / rate_hz, side="right") - 1
    return time_s[0] + steps / rate_hz, values[held]


def grid_steps(time_s: NDArray[np.float64], rate_hz: float) -> int:
    """Return how many steps of the grid the samples at ``time_s`` (sample,) reach."""
    return int(np.floor((time_s[-1] - time_s[0]) * rate_hz + _SLACK)) + 1


def hold_segments(
    time_s: NDArray[np.float64],
    values: NDArray[np.float64],
    segments: Sequence[tuple[int, int]],
    rate_hz: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[tuple[int, int], ...]]:
    """Put every segment on a grid of its own; return times, values and the new segments."""
    held = [
        hold_on_grid(time_s[start:stop], values[start:stop], rate_hz) for start, stop in segments
    ]
    borders = np.cumsum([0, *(len(times) for times, _ in held)]).tolist()
    return (
        np.concatenate([times for times, _ in held]),
        np.concatenate([rows for _, rows in held]),
        tuple(itertools.pairwise(borders)),
    )
