"""Two outlier detectors from PyOD's catalogue, on window statistics, made to look at train only.

PyOD (Chen et al. 2025, WWW Companion) belongs to the full study; nothing else needs it.
"""

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odisar.baselines.contexts import ContextDetector
from odisar.baselines.window_statistics import window_statistics
from odisar.errors import OdisarError
from odisar.seeding import derive_seed

FloatArray = NDArray[np.float64]

# The seeds that PyOD takes have so many bits.
_SEED_BITS = 32


class IsolationForest(ContextDetector):
    """How few random cuts part a context from normal ones (Liu, Ting and Zhou 2008, ICDM).

    PyOD's scores are s - o, with s between 0 and 1 (eq. 2 of the paper) and o a quantile of s over
    the training contexts. A score depends on its own context and the forest alone. Adding o again
    makes it s, which is above zero.
    """

    def _fit_contexts(self, contexts: FloatArray, seed: int) -> None:
        """Raise OdisarError if PyOD isn't installed."""
        forest = _pyod_class("iforest", "IForest")
        drawn = derive_seed(seed, "isolation-forest") % 2**_SEED_BITS
        self._forest = forest(random_state=drawn).fit(window_statistics(contexts))

    def _score_contexts(self, contexts: FloatArray) -> FloatArray:
        beyond_quantile = self._forest.decision_function(window_statistics(contexts))
        return np.asarray(beyond_quantile - self._forest.offset_)  # offset_ is -o


class Ecod(ContextDetector):
    """How far out in the tails of the training contexts each statistic is (ECOD).

    Li et al. 2022, IEEE Trans. Knowledge and Data Engineering 35(12): minus the logarithms of both
    tail probabilities of the empirical distribution, by statistic.

    PyOD 3.6.7 joins the windows of a call to the training windows and ranks all of them together,
    so that a window's score depends on the others of the call, later ones too. Here a window is
    ranked among the training windows and itself, as in a PyOD call with that window alone. As
    there, the larger of both is taken by statistic and then summed; the paper sums first, which is
    another score.
    """

    def _fit_contexts(self, contexts: FloatArray, seed: int) -> None:  # noqa: ARG002 (no chance in it)
        self._sorted = np.sort(window_statistics(contexts), axis=0)

    def _score_contexts(self, contexts: FloatArray) -> FloatArray:
        statistics = window_statistics(contexts)
        return np.asarray(
            sum(
                _rarity(column, seen)
                for column, seen in zip(statistics.T, self._sorted.T, strict=True)
            )
        )


def _rarity(values: FloatArray, seen: FloatArray) -> FloatArray:
    """Return (context,) minus the log of the rarer tail, counting a value among the sorted seen."""
    count = len(seen)
    below = np.searchsorted(seen, values, side="right")  # seen values not above
    above = count - np.searchsorted(seen, values, side="left")  # seen values not below
    return np.asarray(np.log(count + 1) - np.log(np.minimum(below, above) + 1))


def _pyod_class(module: str, name: str) -> Any:
    """Return a class of PyOD. Raise OdisarError, naming the way out, where it is missing."""
    try:
        return getattr(importlib.import_module(f"pyod.models.{module}"), name)
    except ImportError as error:
        raise OdisarError(
            f"the detector {name} needs PyOD ({error}); install the study's packages with "
            "`make study-setup`, or leave the detector out"
        ) from error
