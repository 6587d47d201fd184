"""Consistency of states within one sample: what the others say a state should be, and what it is.

Physics ties the states of one instant: a speed to the rate of a pose, a roll to a turn. What a
fitted relation leaves is a parity residual of analytical redundancy (Chow and Willsky, IEEE Trans.
Automatic Control 1984). It complements an innovation. A sensor that has been off for a minute
deceives whoever forecasts from its own past, yet goes on contradicting the others; and a residual
forgets at once, as no earlier sample is in it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray

from odisar.capability.innovations import FloatArray
from odisar.errors import OdisarError
from odisar.forecasters.closed_form import design, design_width

#: Ridge penalty per sample, in units of the scaled design: keeps states that move as one apart.
_RIDGE = 1.0e-6


#: A relation holds if it explains this share of a state's variance on held-out recordings.
_HOLDS = 0.5
#: Samples whose products are summed at a time; a matter of memory, not of results.
_CHUNK = 4096


@dataclass(frozen=True)
class Consistency:
    """Relations that hold within a sample: each state, from all other features.

    ``states`` are the positions of the states among the features; ``weights`` (state, regressor)
    are of the closed form's regressors with one sample (``closed_form.design``), zero wherever the
    state itself is in one.
    """

    states: tuple[int, ...]
    weights: FloatArray

    @classmethod
    def fit(cls, samples: NDArray[np.floating], states: Sequence[int]) -> Self:
        """Fit on (time, feature) scaled samples of training recordings, by least squares.

        Samples that aren't known whole (the first of a relative pose) don't count. Raises
        OdisarError where fewer are left than there are regressors.
        """
        every = samples.astype(np.float64)
        known = every[np.isfinite(every).all(axis=1)]
        features = every.shape[1]
        if len(known) <= (needed := design_width(features, 1)):
            raise OdisarError(
                f"{len(known)} training samples cannot give the {needed} weights that tie a state "
                "to the others; add training recordings or declare fewer channels"
            )
        parts = (_regressors(known[at : at + _CHUNK]) for at in range(0, len(known), _CHUNK))
        gram = sum((part.T @ part for part in parts), start=np.zeros((needed, needed)))
        penalised = gram + _RIDGE * len(known) * np.eye(needed)
        weights = np.zeros((len(states), needed))
        for row, state in enumerate(states):
            others = np.flatnonzero(_is_of_others(features, state))
            cross = gram[others, state]
            weights[row, others] = np.linalg.solve(penalised[np.ix_(others, others)], cross)
        return cls(tuple(states), weights)

    def residuals(self, samples: NDArray[np.floating]) -> FloatArray:
        """Return (time, state) what each state is, less what the others say, scaled.

        ``samples`` (time, feature) are scaled; NaN where one isn't known whole.
        """
        values = samples.astype(np.float64)
        return np.asarray(values[:, list(self.states)] - _regressors(values) @ self.weights.T)

    def share_holding(self, samples: NDArray[np.floating]) -> float:
        """Return the share of states whose relation holds on (time, feature) scaled samples.

        It holds if it explains at least half of the state's variance there. On recordings that it
        wasn't fitted to, one that has learnt too much from too little doesn't.
        """
        known = samples[np.isfinite(samples).all(axis=1)].astype(np.float64)
        left = np.mean(self.residuals(known) ** 2, axis=0)
        return float(np.mean(left <= (1 - _HOLDS) * known[:, list(self.states)].var(axis=0)))


def _regressors(samples: FloatArray) -> FloatArray:
    """Return (time, regressor) of (time, feature) samples; the first are the features."""
    return np.asarray(design(torch.from_numpy(samples)[:, None], 1).numpy())


def _is_of_others(features: int, state: int) -> NDArray[np.bool_]:
    """Return (regressor,) whether a state has no part in each: none vanishes when it alone is 0."""
    without = np.ones((1, features))
    without[0, state] = 0.0
    return np.asarray(_regressors(without)[0] != 0)
