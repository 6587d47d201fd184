"""Windows as positions in one array of samples: a batch is gathered when it is asked for."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from odisar.recordings.schema import Recording
from odisar.windows.scaling import Scaler


@dataclass(frozen=True)
class WindowSpec:
    """Lengths of context and horizon in steps, and which channels stand where.

    ``outputs`` are the positions of the forecast states among the channels; ``known_ahead`` those
    of the commands whose future the decoder may see.
    """

    context_steps: int
    horizon_steps: int
    outputs: tuple[int, ...]
    known_ahead: tuple[int, ...]


@dataclass(frozen=True)
class Batch:
    """What the twin gets, and the truth it is held against.

    ``context`` (window, context step, channel), ``known_future`` (window, horizon step, command)
    and ``truth`` (window, horizon step, state), all scaled.
    """

    context: torch.Tensor
    known_future: torch.Tensor
    truth: torch.Tensor


class WindowSet:
    """All windows of some recordings, as issue positions in one (sample, channel) tensor.

    A window is named by the position of its last context sample, the *issue position* t. Memory
    grows with the samples, not with windows x steps: ``gather`` indexes a strided view.
    """

    def __init__(
        self,
        recordings: Sequence[Recording],
        scaler: Scaler,
        spec: WindowSpec,
        *,
        stride_steps: int = 1,
    ) -> None:
        self.spec = spec
        scaled = [scaler.scale(recording.values) for recording in recordings]
        self.samples = torch.from_numpy(np.concatenate(scaled))
        self.issues = torch.from_numpy(_issue_positions(recordings, spec, stride_steps))
        length = spec.context_steps + spec.horizon_steps
        self._view = self.samples.unfold(0, length, 1)  # (start, channel, step), no copy

    def __len__(self) -> int:
        """Return the number of windows."""
        return len(self.issues)

    def gather(self, windows: torch.Tensor) -> Batch:
        """Return the windows at these positions of the index."""
        spec = self.spec
        starts = self.issues[windows] - (spec.context_steps - 1)
        steps = self._view[starts].transpose(1, 2)
        future = steps[:, spec.context_steps :]
        return Batch(
            context=steps[:, : spec.context_steps],
            known_future=future[..., list(spec.known_ahead)],
            truth=future[..., list(spec.outputs)],
        )


def issue_positions(
    segment: tuple[int, int], context_steps: int, horizon_steps: int, stride_steps: int
) -> NDArray[np.int64]:
    """Return the positions t in a segment that have their whole context and horizon inside it."""
    start, stop = segment
    return np.arange(start + context_steps - 1, stop - horizon_steps, stride_steps, dtype=np.int64)


def _issue_positions(
    recordings: Sequence[Recording], spec: WindowSpec, stride_steps: int
) -> NDArray[np.int64]:
    positions: list[NDArray[np.int64]] = [np.empty(0, dtype=np.int64)]
    offset = 0
    for recording in recordings:
        positions.extend(
            offset + issue_positions(segment, spec.context_steps, spec.horizon_steps, stride_steps)
            for segment in recording.segments
        )
        offset += len(recording.time_s)
    return np.concatenate(positions)
