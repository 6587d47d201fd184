"""What a forecast is held against: the states of the horizon, a pose relative to the last one."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from odisar.recordings.schema import Recording
from odisar.windows.coordinates import FloatArray, moved_from, relative_to
from odisar.windows.windowing import WindowSpec


def horizon_targets(
    values: FloatArray, positions: NDArray[np.int64], spec: WindowSpec
) -> FloatArray:
    """Return (window, step, state) what was observed after each of ``positions``, physical units.

    ``values`` is (sample, channel) of one segment; steps beyond its end are NaN. States of a
    relative pose are those of the pose in the frame of the pose at the window's position.
    """
    at = positions[:, None] + np.arange(1, spec.horizon_steps + 1)
    known = at < len(values)
    at = np.minimum(at, len(values) - 1)
    targets: FloatArray = values[at][..., list(spec.outputs)]
    if spec.pose is not None:
        pose = spec.pose.read(values)
        moved = spec.pose.write(relative_to(pose[at], pose[positions][:, None]))
        for state, place in _pose_states(spec):
            targets[..., state] = moved[..., place]
    targets[~known] = np.nan
    return targets


def recorded_states(
    targets: FloatArray, recording: Recording, positions: NDArray[np.int64], spec: WindowSpec
) -> FloatArray:
    """Return (..., window, step, state) targets in the recording's own coordinates.

    The inverse of ``horizon_targets``. Parts of a pose that aren't forecast count as unchanged.
    """
    if spec.pose is None:
        return targets
    origin = spec.pose.read(recording.values[positions])[:, None]
    still = spec.pose.write(np.zeros(3))
    moved = np.broadcast_to(still, (*targets.shape[:-1], len(still))).copy()
    for state, place in _pose_states(spec):
        moved[..., place] = targets[..., state]
    first = spec.pose.positions
    as_channels = np.zeros((*targets.shape[:-1], max(first) + 1))
    as_channels[..., list(first)] = moved
    back = spec.pose.write(moved_from(origin, spec.pose.read(as_channels)))
    states = targets.copy()
    for state, place in _pose_states(spec):
        states[..., state] = back[..., place]
    return states


def training_targets(recordings: Sequence[Recording], spec: WindowSpec) -> FloatArray:
    """Return (window x step, state) targets of windows that share no horizon step."""
    parts = [
        horizon_targets(
            recording.values[:stop], spec.issue_positions((start, stop), spec.horizon_steps), spec
        )
        for recording in recordings
        for start, stop in recording.segments
    ]
    return np.concatenate(parts).reshape(-1, len(spec.outputs))


def _pose_states(spec: WindowSpec) -> list[tuple[int, int]]:
    """Return, for each forecast state that is part of the pose, its place in states and pose."""
    places = {} if spec.pose is None else {at: i for i, at in enumerate(spec.pose.positions)}
    return [(state, places[at]) for state, at in enumerate(spec.outputs) if at in places]
