"""Consistency of states within one sample: what the others say a state should be, and what it is.

Physics ties the states of one instant: a speed to the rate of a pose, a roll to a turn. What a
fitted relation leaves is a parity residual of analytical redundancy (Chow and Willsky, IEEE Trans.
Automatic Control 1984). It complements an innovation. A sensor that has been off for a minute
deceives whoever forecasts from its own past, yet goes on contradicting the others; and a residual
forgets at once: no sample before its own is in it (of a relative pose, whose features are rates,
the one before).
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
#: Consecutive parts of the training samples that are left out in turn to choose regressors by.
_PARTS = 5
#: With more of them no products are tried: they would be fitted for minutes.
_MOST_REGRESSORS = 500
#: Samples whose regressors are in memory at a time.
_CHUNK = 16384
#: A relation holds if it explains this share of a state's variance on held-out recordings.
_HOLDS = 0.5


@dataclass(frozen=True)
class Consistency:
    """Relations that hold within a sample: each state, from all other features.

    ``states`` are the positions of the states among the features; ``weights`` (state, regressor)
    are of the closed form's regressors with one sample (``closed_form.design``), zero wherever the
    state itself is in one. A state has products and squares in its relation only if they said more
    of training samples that were left out: from few recordings they are learnt by heart.
    """

    states: tuple[int, ...]
    weights: FloatArray

    @classmethod
    def fit(cls, samples: NDArray[np.floating], states: Sequence[int]) -> Self:
        """Fit on (time, feature) scaled samples of training recordings, by least squares.

        Samples that aren't known whole (the first of a relative pose) don't count. Raises
        OdisarError where fewer are left than a straight relation has weights.
        """
        every = samples.astype(np.float64)
        known = every[np.isfinite(every).all(axis=1)]
        features = every.shape[1]
        if len(known) <= (needed := features + 1):
            raise OdisarError(
                f"{len(known)} training samples cannot give the {needed} weights that tie a state "
                "to the others; add training recordings or declare fewer channels"
            )
        parts = [_Sums.over(part) for part in np.array_split(known, _PARTS)]
        every_part = _Sums.of(parts)
        others = [_Sums.of([*parts[:i], *parts[i + 1 :]]) for i in range(_PARTS)]
        weights = np.zeros((len(states), design_width(features, 1)))
        for row, state in enumerate(states):
            bent = np.flatnonzero(_is_of_others(features, state))
            straight = bent[(bent < features) | (bent == weights.shape[1] - 1)]
            chosen = straight
            if len(bent) <= _MOST_REGRESSORS:
                errors = [_left_out(parts, others, c, state) for c in (straight, bent)]
                chosen = bent if errors[1] < errors[0] else straight
            weights[row, chosen] = every_part.solve(chosen, state)
        return cls(tuple(states), weights)

    def residuals(self, samples: NDArray[np.floating]) -> FloatArray:
        """Return (time, state) what each state is, less what the others say, scaled.

        ``samples`` (time, feature) are scaled; NaN where one isn't known whole.
        """
        parts = [
            part[:, list(self.states)] - _regressors(part) @ self.weights.T
            for part in _chunks(samples.astype(np.float64))
        ]
        return np.concatenate([np.empty((0, len(self.states))), *parts])

    def share_holding(self, samples: NDArray[np.floating]) -> float:
        """Return the share of states whose relation holds on (time, feature) scaled samples.

        It holds if it explains at least half of the state's variance there. On recordings that it
        wasn't fitted to, one that has learnt too much from too little doesn't.
        """
        known = samples[np.isfinite(samples).all(axis=1)].astype(np.float64)
        if not len(known):
            return 0.0
        left = np.mean(self.residuals(known) ** 2, axis=0)
        variance = known[:, list(self.states)].var(axis=0)
        return float(np.mean((left <= (1 - _HOLDS) * variance) & (variance > 0)))


@dataclass(frozen=True)
class _Sums:
    """Products of the regressors with one another, summed over so many samples."""

    gram: FloatArray
    samples: int

    @classmethod
    def over(cls, samples: FloatArray) -> Self:
        """Return the sums over (time, feature) samples."""
        width = design_width(samples.shape[1], 1)
        grams = [part.T @ part for part in map(_regressors, _chunks(samples))]
        return cls(sum(grams, start=np.zeros((width, width))), len(samples))

    @classmethod
    def of(cls, parts: Sequence["_Sums"]) -> Self:
        """Return the sums over several parts."""
        grams = [part.gram for part in parts]
        return cls(np.sum(grams, axis=0), sum(part.samples for part in parts))

    def solve(self, columns: NDArray[np.intp], state: int) -> FloatArray:
        """Return (column,) the ridge weights of some regressors for a state, itself a regressor."""
        penalty = _RIDGE * self.samples * np.eye(len(columns))
        return np.linalg.solve(
            self.gram[np.ix_(columns, columns)] + penalty, self.gram[columns, state]
        )

    def squared_error(self, columns: NDArray[np.intp], state: int, weights: FloatArray) -> float:
        """Return the sum of squared errors that weights have on these samples."""
        own, cross = self.gram[state, state], self.gram[columns, state]
        size = weights @ self.gram[np.ix_(columns, columns)] @ weights
        return float(own - 2 * weights @ cross + size)


def _left_out(
    parts: Sequence[_Sums], others: Sequence[_Sums], columns: NDArray[np.intp], state: int
) -> float:
    """Return the squared error on all parts, each said by weights fitted to its ``others``."""
    return sum(
        part.squared_error(columns, state, rest.solve(columns, state))
        for part, rest in zip(parts, others, strict=True)
    )


def _chunks(samples: FloatArray) -> list[FloatArray]:
    return [samples[at : at + _CHUNK] for at in range(0, len(samples), _CHUNK)]


def _regressors(samples: FloatArray) -> FloatArray:
    """Return (time, regressor) of (time, feature) samples; the first are the features."""
    return np.asarray(design(torch.from_numpy(samples)[:, None], 1).numpy())


def _is_of_others(features: int, state: int) -> NDArray[np.bool_]:
    """Return (regressor,) whether a state has no part in each: none vanishes when it alone is 0."""
    without = np.ones((1, features))
    without[0, state] = 0.0
    return np.asarray(_regressors(without)[0] != 0)
