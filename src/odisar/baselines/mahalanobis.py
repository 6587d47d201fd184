"""Mahalanobis distance on window statistics: how far a context is from the mean of normal ones."""

import numpy as np
from numpy.typing import NDArray
from sklearn.covariance import ledoit_wolf

from odisar.baselines.contexts import ContextDetector
from odisar.baselines.window_statistics import window_statistics

FloatArray = NDArray[np.float64]

# A statistic that never varies in training has no spread; any later change then shows as large.
_SMALLEST_STD = 1e-6


class Mahalanobis(ContextDetector):
    """Squared Mahalanobis distance (Mahalanobis 1936, Proc. Nat. Inst. Sci. India) of statistics.

    The statistics are standardised, and their covariance is shrunk towards a multiple of the
    identity by as much as the data ask for (Ledoit and Wolf 2004, Journal of Multivariate Analysis
    88(2)): several statistics nearly follow from the others.
    """

    def _fit_contexts(self, contexts: FloatArray, seed: int) -> None:  # noqa: ARG002 (no chance in it)
        statistics = window_statistics(contexts)
        self._mean = statistics.mean(axis=0)
        std = np.maximum(statistics.std(axis=0), _SMALLEST_STD)
        covariance, _ = ledoit_wolf((statistics - self._mean) / std, assume_centered=True)
        # The inverse of the covariance is L L' with this L, so that no distance is below zero.
        root = np.linalg.cholesky(np.linalg.inv(covariance))
        self._whitening = root / std[:, None]

    def _score_contexts(self, contexts: FloatArray) -> FloatArray:
        white = (window_statistics(contexts) - self._mean) @ self._whitening
        return np.asarray((white**2).sum(axis=1))
