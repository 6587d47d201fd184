"""Standardise features and targets with mean and standard deviation of the training recordings."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odisar.recordings.schema import Recording
from odisar.windows.coordinates import features
from odisar.windows.targets import training_targets
from odisar.windows.windowing import WindowSpec

# A command that never moves in training has no spread; dividing by this keeps it at zero instead
# of infinity, and any later movement shows as a very large scaled value.
_SMALLEST_STD = 1e-6


@dataclass(frozen=True)
class Scaler:
    """Of features ``mean`` and ``std`` (feature,), of targets (state,), in physical units."""

    mean: NDArray[np.float64]
    std: NDArray[np.float64]
    target_mean: NDArray[np.float64]
    target_std: NDArray[np.float64]

    @classmethod
    def fit(cls, recordings: Sequence[Recording], spec: WindowSpec) -> "Scaler":
        """Fit on all samples of the training recordings, and on nothing else."""
        seen = [
            features(recording, spec.pose)[start + spec.unusable_steps : stop]
            for recording in recordings
            for start, stop in recording.segments
        ]
        mean, std = _moments(np.concatenate(seen))
        outputs = list(spec.outputs)
        if spec.pose is None:
            return cls(mean, std, mean[outputs], std[outputs])
        return cls(mean, std, *_moments(training_targets(recordings, spec)))

    def scale(self, values: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return (..., feature) scaled features."""
        return ((values - self.mean) / self.std).astype(np.float32)

    def scale_targets(self, targets: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return (..., state) scaled targets."""
        return ((targets - self.target_mean) / self.target_std).astype(np.float32)

    def unscale_targets(self, scaled: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
        """Return (..., state) targets in physical units."""
        return np.asarray(scaled, dtype=np.float64) * self.target_std + self.target_mean


def channel_std(recordings: Sequence[Recording]) -> NDArray[np.float64]:
    """Return (channel,) standard deviation over all samples, in physical units, never zero."""
    return _moments(np.concatenate([recording.values for recording in recordings]))[1]


def _moments(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return values.mean(axis=0), np.maximum(values.std(axis=0), _SMALLEST_STD)
