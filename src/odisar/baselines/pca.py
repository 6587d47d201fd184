"""Principal components of whole contexts: how far along them, and how far beside them.

Jackson and Mudholkar 1979, Technometrics 21(3): control of residuals in principal component
analysis, with T2 of the components kept and Q (the squared prediction error, SPE) of the rest.
"""

import numpy as np
from numpy.typing import NDArray
from sklearn.decomposition import PCA

from odisar.baselines.contexts import ContextDetector

FloatArray = NDArray[np.float64]

# The share of the variance that the components kept explain.
_EXPLAINED = 0.95


class _Components(ContextDetector):
    """Components of scaled contexts laid out flat, fitted alike for both statistics."""

    def _fit_contexts(self, contexts: FloatArray, seed: int) -> None:  # noqa: ARG002 (no chance in it)
        # Named, since the solver chosen by default may draw at random.
        analysis = PCA(_EXPLAINED, svd_solver="covariance_eigh").fit(_flat(contexts))
        self._mean = analysis.mean_
        self._axes = analysis.components_.T
        self._variance = analysis.explained_variance_

    def _centred(self, contexts: FloatArray) -> FloatArray:
        """Return (context, step x feature) less the training contexts' mean."""
        return np.asarray(_flat(contexts) - self._mean)


class PcaT2(_Components):
    """T2: the squared distance along the components kept, each in units of its own spread."""

    def _score_contexts(self, contexts: FloatArray) -> FloatArray:
        along = self._centred(contexts) @ self._axes
        return np.asarray((along**2 / self._variance).sum(axis=1))


class PcaSpe(_Components):
    """Q: the squared distance from the components kept, which they cannot explain."""

    def _score_contexts(self, contexts: FloatArray) -> FloatArray:
        centred = self._centred(contexts)
        # By Pythagoras, without laying out the part that is explained.
        return np.asarray((centred**2).sum(axis=1) - ((centred @ self._axes) ** 2).sum(axis=1))


def _flat(contexts: FloatArray) -> FloatArray:
    return contexts.reshape(len(contexts), -1)
