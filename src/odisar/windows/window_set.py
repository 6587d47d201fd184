"""Scaled samples, and the windows in them."""

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from odisar.recordings.schema import Recording
from odisar.windows.coordinates import feature_positions, features
from odisar.windows.scaling import Scaler
from odisar.windows.targets import horizon_targets
from odisar.windows.windowing import Batch, WindowSpec, window_positions


class WindowSet:
    """All windows of some recordings, as issue positions in one (sample, feature) tensor.

    A window is named by the position of its last context sample, the *issue position* t. Memory
    grows with the samples, not with windows x steps: ``gather`` takes the steps when asked.
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
        self.samples = scaled_features(recordings, scaler, spec)
        self.issues = torch.from_numpy(window_positions(recordings, spec, stride_steps))
        self._values = np.concatenate([recording.values for recording in recordings])
        self._scaler = scaler

    def __len__(self) -> int:
        """Return the number of windows."""
        return len(self.issues)

    @property
    def channels(self) -> int:
        """How many channels a sample has."""
        return int(self._values.shape[1])

    def gather(self, windows: torch.Tensor) -> Batch:
        """Return the windows at these positions of the index."""
        issues = self.issues[windows].numpy()
        context, known = model_inputs(self.samples, issues, self.spec, self._values.shape[1])
        targets = horizon_targets(self._values, issues, self.spec)
        truth = torch.from_numpy(self._scaler.scale_targets(targets))
        return Batch(context, known, truth, self.samples[self.issues[windows] + 1])


def scaled_features(
    recordings: Sequence[Recording], scaler: Scaler, spec: WindowSpec
) -> torch.Tensor:
    """Return (sample, feature) of all recordings, one after the other."""
    scaled = [scaler.scale(features(recording, spec.pose)) for recording in recordings]
    return torch.from_numpy(np.concatenate(scaled))


def model_inputs(
    samples: torch.Tensor, positions: NDArray[np.int64], spec: WindowSpec, channels: int
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return context and known future of windows: all that the network may see of them.

    ``samples`` are scaled features (sample, feature) of recordings with so many channels. The
    context is (window, context step, feature), the known future (window, horizon step, command):
    without commands unless they are declared known ahead, and nothing else after a position is
    touched.
    """
    at = torch.from_numpy(positions)[:, None]
    context = samples[at + torch.arange(1 - spec.context_steps, 1)]
    if not spec.known_ahead:
        return context, torch.empty(len(positions), spec.horizon_steps, 0)
    ahead = samples[at + torch.arange(1, spec.horizon_steps + 1)]
    return context, ahead[..., list(feature_positions(spec.known_ahead, channels, spec.pose))]
