"""When an event had a consequence: a state outside everything calibration has shown."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from odisar.config.cases import Case
from odisar.recordings.schema import Recording


def first_consequence(
    recording: Recording, case: Case, limits: Mapping[str, Any], lasting_s: float
) -> float | None:
    """Return the first time [s] after onset at which a state had been outside for ``lasting_s``.

    "Outside" is beyond the lowest or highest value of any calibration recording (``state_low`` and
    ``state_high`` by state name, physical units). None without an event or a consequence.
    """
    if not recording.intervals:
        return None
    onset_s = min(interval.start_s for interval in recording.intervals)
    low = np.array([limits["state_low"][name] for name in case.output_names])
    high = np.array([limits["state_high"][name] for name in case.output_names])
    values = recording.values[:, case.output_indices]
    outside = (values < low) | (values > high)
    outside &= (recording.time_s >= onset_s)[:, None]
    steps = max(1, round(lasting_s * case.rate_hz))
    for start, stop in recording.segments:
        if stop - start < steps:
            continue
        runs = np.lib.stride_tricks.sliding_window_view(outside[start:stop], steps, axis=0)
        found = np.flatnonzero(runs.all(axis=-1).any(axis=-1))
        if found.size:
            return float(recording.time_s[start + found[0] + steps - 1])
    return None
