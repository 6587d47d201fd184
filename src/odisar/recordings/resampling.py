"""Put a recording on a regular grid without looking ahead: each grid sample holds the last one."""

import itertools
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

# The same moment, written or added up in two ways, differs by rounding: this share of a period.
_SLACK = 1e-6


def rounding_periods(time_s: NDArray[np.float64], rate_hz: float) -> float:
    """Return by how much of a period ``time_s`` (sample,) may be off by rounding alone.

    Seconds since 1970 are stored in steps of 0.24 us, which at high rates is more than a
    millionth of a period.
    """
    return _SLACK + 2.0 * float(np.spacing(np.abs(time_s).max())) * rate_hz


def hold_on_grid(
    time_s: NDArray[np.float64], values: NDArray[np.float64], rate_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times (step,) and values (step, column) on the grid of ``rate_hz``.

    ``time_s`` (sample,) in seconds must rise; ``values`` is (sample, column). The grid starts at
    the first sample and ends at the last grid time that a sample reaches. Each step holds the
    last sample at or before it (up to the rounding of the times), so that no step depends on a
    later sample.
    """
    if len(time_s) == 0:
        return time_s.copy(), values.copy()
    held = held_samples(time_s, rate_hz)
    return time_s[0] + np.arange(len(held)) / rate_hz, values[held]


def held_samples(time_s: NDArray[np.float64], rate_hz: float) -> NDArray[np.int64]:
    """Return (step,) the position of the sample that each step of the grid holds."""
    slack = rounding_periods(time_s, rate_hz)
    steps = np.arange(grid_steps(time_s, rate_hz))
    held = np.searchsorted(time_s - time_s[0], (steps + slack) / rate_hz, side="right") - 1
    return np.asarray(held, dtype=np.int64)


def grid_steps(time_s: NDArray[np.float64], rate_hz: float) -> int:
    """Return how many steps of the grid the samples at ``time_s`` (sample,) reach."""
    slack = rounding_periods(time_s, rate_hz)
    return int(np.floor((time_s[-1] - time_s[0]) * rate_hz + slack)) + 1


def thin_to_grid(
    time_s: NDArray[np.float64], values: NDArray[np.float64], rate_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times and values of the samples that the grid would hold, each once, as recorded.

    They keep their own stamps, so that an increment can be divided by the time it took.
    """
    kept = np.unique(held_samples(time_s, rate_hz))
    return time_s[kept], values[kept]


def resample_segments(
    time_s: NDArray[np.float64],
    values: NDArray[np.float64],
    segments: Sequence[tuple[int, int]],
    rate_hz: float,
    how: Literal["hold", "thin"],
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[tuple[int, int], ...]]:
    """Put every segment on a grid of its own; return times, values and the new segments."""
    resample = hold_on_grid if how == "hold" else thin_to_grid
    held = [resample(time_s[start:stop], values[start:stop], rate_hz) for start, stop in segments]
    borders = np.cumsum([0, *(len(times) for times, _ in held)]).tolist()
    return (
        np.concatenate([times for times, _ in held]),
        np.concatenate([rows for _, rows in held]),
        tuple(itertools.pairwise(borders)),
    )
