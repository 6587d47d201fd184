"""Windows as positions in one array of samples: a batch is gathered when it is asked for."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from odisar.recordings.schema import Recording
from odisar.windows.coordinates import POSE_RATES, PoseChannels, feature_positions


@dataclass(frozen=True)
class WindowSpec:
    """Lengths of context and horizon in steps, and which channels stand where.

    ``outputs`` are the positions of the forecast states among the channels; ``commands`` those of
    the commands, and ``known_ahead`` of the commands whose future the decoder may see; ``pose`` is
    the pose that the twin sees in relative coordinates, if any.
    """

    context_steps: int
    horizon_steps: int
    outputs: tuple[int, ...]
    commands: tuple[int, ...]
    known_ahead: tuple[int, ...]
    pose: PoseChannels | None = None

    @property
    def unusable_steps(self) -> int:
        """Samples at the start of a segment that no context can hold: they have no increment."""
        return 0 if self.pose is None else 1

    def feature_count(self, channels: int) -> int:
        """Return how many features a sample of so many channels has."""
        if self.pose is None:
            return channels
        return channels - len(self.pose.positions) + POSE_RATES

    def state_features(self, channels: int) -> tuple[int, ...]:
        """Return which features are states: all but the commands."""
        commands = feature_positions(self.commands, channels, self.pose)
        return tuple(i for i in range(self.feature_count(channels)) if i not in commands)

    def issue_positions(
        self, segment: tuple[int, int], stride_steps: int, *, horizon_steps: int | None = None
    ) -> NDArray[np.int64]:
        """Return the positions t in a segment that have their whole context and horizon inside it.

        ``horizon_steps`` replaces the spec's own where less (or nothing) of the future is needed.
        """
        start, stop = segment
        ahead = self.horizon_steps if horizon_steps is None else horizon_steps
        first = start + self.unusable_steps + self.context_steps - 1
        return np.arange(first, stop - ahead, stride_steps, dtype=np.int64)


@dataclass(frozen=True)
class Batch:
    """What the twin gets, and the truth it is held against.

    ``context`` (window, context step, feature), ``known_future`` (window, horizon step, command),
    ``truth`` (window, horizon step, state) and ``next_sample`` (window, feature), the sample after
    the context; all scaled.
    """

    context: torch.Tensor
    known_future: torch.Tensor
    truth: torch.Tensor
    next_sample: torch.Tensor


def window_positions(
    recordings: Sequence[Recording], spec: WindowSpec, stride_steps: int
) -> NDArray[np.int64]:
    """Return the issue positions of all windows, counted over the recordings joined together."""
    positions: list[NDArray[np.int64]] = [np.empty(0, dtype=np.int64)]
    offset = 0
    for recording in recordings:
        positions.extend(
            offset + spec.issue_positions(segment, stride_steps) for segment in recording.segments
        )
        offset += len(recording.time_s)
    return np.concatenate(positions)
