"""Standardise channels with the mean and standard deviation of the training recordings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.recordings.schema import Recording

# A command that never moves in training has no spread; dividing by this keeps it at zero instead
# of infinity, and any later movement shows as a very large scaled value.
_SMALLEST_STD = 1e-6


@dataclass(frozen=True)
class Scaler:
    """``mean`` and ``std`` (channel,) in physical units."""

    mean: NDArray[np.float64]
    std: NDArray[np.float64]

    @classmethod
    def fit(cls, recordings: Sequence[Recording]) -> "Scaler":
        """Fit on all samples of the training recordings, and on nothing else."""
        values = np.concatenate([recording.values for recording in recordings])
        return cls(values.mean(axis=0), np.maximum(values.std(axis=0), _SMALLEST_STD))

    def scale(self, values: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return (sample, channel) scaled values."""
        return ((values - self.mean) / self.std).astype(np.float32)

    def unscale(self, scaled: NDArray[np.floating], channels: Sequence[int]) -> NDArray[np.float64]:
        """Return (..., channel) physical values of the named channel positions."""
        picked = list(channels)
        return np.asarray(scaled, dtype=np.float64) * self.std[picked] + self.mean[picked]
