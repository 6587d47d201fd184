"""Recalibration: what happens as often as was said (Kuleshov, Fenner and Ermon, ICML 2018).

A forecast says the truth stays below some value with probability u. On held-out recordings it did
so with frequency R(u). Said is then R(u) instead of u: the cumulative distribution F becomes
R(F(y)), its quantile at p becomes the old one at the level that R takes to p. R increases, so
forecasts are stretched and shifted, never reordered.

Windows of one recording depend on one another, so R is fitted on windows that share no forecast
sample, one horizon apart (``distribution.disjoint_positions``). The steps of a window still do; R
is smooth enough (a few hundred knots) to live with that, the number of windows says how far to
trust it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from sklearn.isotonic import IsotonicRegression

from odisar.capability.distribution import (
    FloatArray,
    GaussianForecast,
    NoiseFloor,
    draws_only,
    with_noise,
)
from odisar.errors import OdisarError

#: Names of the distributions that are compared.
DRAWS, DRAWS_PLUS_NOISE, RECALIBRATED = "draws", "draws-plus-noise", "recalibrated"

# A level of exactly 0 or 1 has an infinite quantile; this far from the ends is 7 standard
# deviations from the mean. No recalibration mends a spread that is more than that too small.
_END = 1e-12
_KNOTS = 201
#: Fewer windows than these don't say how often forecasts hold.
FEWEST_WINDOWS = 20
#: Levels of the midpoint rule for moments and CRPS; 2000 give a normal's spread to 0.03 %.
_MIDPOINTS = (np.arange(2000) + 0.5) / 2000


@dataclass(frozen=True)
class LevelMap:
    """An increasing map from predicted levels to observed frequencies, linear between its knots.

    ``predicted`` and ``observed`` are (knot,), both strictly increasing from 0 to 1.
    """

    predicted: FloatArray
    observed: FloatArray

    def frequencies(self, levels: FloatArray) -> FloatArray:
        """Return (...) how often the truth stays below what has these predicted levels."""
        return np.interp(levels, self.predicted, self.observed)

    def levels(self, frequencies: FloatArray) -> FloatArray:
        """Return (...) the predicted levels of these frequencies: the inverse."""
        return np.interp(frequencies, self.observed, self.predicted)


@dataclass(frozen=True)
class Recalibration:
    """A level map for each group of neighbouring steps and each state.

    ``maps`` is [group][state]; the groups divide ``horizon_steps`` evenly, in order. ``windows``
    is how many windows it was fitted on.
    """

    maps: tuple[tuple[LevelMap, ...], ...]
    horizon_steps: int
    windows: int

    def cells(self) -> Iterator[tuple[slice, int, LevelMap]]:
        """Yield the steps of a group, a state, and their map."""
        groups = np.array_split(np.arange(self.horizon_steps), len(self.maps))
        for steps, of_states in zip(groups, self.maps, strict=True):
            for state, level_map in enumerate(of_states):
                yield slice(int(steps[0]), int(steps[-1]) + 1), state, level_map

    def frequencies(self, levels: FloatArray) -> FloatArray:
        """Return (window, step, state) recalibrated levels of (window, step, state) levels."""
        mapped = np.empty(levels.shape)
        for steps, state, level_map in self.cells():
            mapped[:, steps, state] = level_map.frequencies(levels[:, steps, state])
        return mapped

    def as_json(self) -> dict[str, Any]:
        """Return the knots as JSON types."""
        return {
            "horizon_steps": self.horizon_steps,
            "windows": self.windows,
            "maps": [
                [{"predicted": m.predicted.tolist(), "observed": m.observed.tolist()} for m in row]
                for row in self.maps
            ],
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Self:
        """Return what ``as_json`` described; raise OdisarError where it is no recalibration."""
        try:
            maps = tuple(tuple(_read_map(item) for item in row) for row in content["maps"])
            steps, windows = int(content["horizon_steps"]), int(content["windows"])
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise OdisarError(
                f"not a recalibration ({error}); fit it again on held-out recordings"
            ) from error
        same_states = len({len(row) for row in maps}) == 1 and len(maps[0]) > 0
        if not 1 <= len(maps) <= steps or not same_states:
            raise OdisarError(
                f"a recalibration of {len(maps)} step groups doesn't divide {steps} steps with the "
                "same states in each; fit it again on held-out recordings"
            )
        return cls(maps, steps, windows)


@dataclass(frozen=True)
class RecalibratedForecast:
    """A normal forecast seen through a recalibration, per window, step and state.

    It stays one shape per state and group of steps, moved by the mean and stretched by the
    standard deviation of ``base``, whose variance is above zero. Raises OdisarError where the
    recalibration is of another horizon or other states.
    """

    base: GaussianForecast
    recalibration: Recalibration

    def __post_init__(self) -> None:
        wanted = (self.recalibration.horizon_steps, len(self.recalibration.maps[0]))
        if self.base.variance.shape[1:] != wanted:
            raise OdisarError(
                f"a recalibration of (step, state) {wanted} doesn't fit forecasts of "
                f"{self.base.variance.shape[1:]}; fit it on forecasts of the same twin"
            )

    @property
    def std(self) -> FloatArray:
        """Standard deviation (window, step, state), by the midpoint rule over levels."""
        std = self.base.std
        for steps, state, level_map in self.recalibration.cells():
            std[:, steps, state] *= _standard_quantiles(level_map, _MIDPOINTS).std()
        return std

    def levels(self, truth: NDArray[np.floating[Any]]) -> FloatArray:
        """Return (window, step, state) the recalibrated cumulative probability of the truth."""
        return self.recalibration.frequencies(self.base.levels(truth))

    def quantiles(self, level: float) -> FloatArray:
        """Return (window, step, state) what the truth stays below with probability ``level``."""
        quantiles = self.base.mean.copy()
        std = self.base.std
        for steps, state, level_map in self.recalibration.cells():
            standard = _standard_quantiles(level_map, np.array([level]))
            quantiles[:, steps, state] += std[:, steps, state] * standard
        return quantiles

    def interval(self, coverage: float) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds (window, step, state) of the central interval."""
        return self.quantiles((1 - coverage) / 2), self.quantiles((1 + coverage) / 2)

    def crps(self, truth: NDArray[np.floating[Any]]) -> FloatArray:
        """Return (window, step, state) the continuous ranked probability score; lower is better.

        Twice the pinball loss integrated over levels (Gneiting and Ranjan, JBES 2011), by
        the midpoint rule.
        """
        scores, crps = self.base.standard_scores(truth), self.base.std
        for steps, state, level_map in self.recalibration.cells():
            quantiles = _standard_quantiles(level_map, _MIDPOINTS)
            crps[:, steps, state] *= _quantile_crps(quantiles, scores[:, steps, state])
        return crps


def fit_recalibration(
    levels: Sequence[NDArray[np.floating[Any]]], *, step_groups: int = 1
) -> Recalibration:
    """Fit the map of every state, and of every group of steps, by isotonic regression.

    ``levels`` holds for each held-out recording the (window, step, state) predicted levels of the
    truth, at windows that share no forecast sample; NaN levels don't count. The frequency of the
    i-th smallest of n levels is i / (n + 1), so that both ends stay possible.

    Raises OdisarError where there are too few windows, or more groups than steps.
    """
    nothing = np.empty((0, 1, 1))
    joined = np.concatenate([np.asarray(part, dtype=np.float64) for part in levels] or [nothing])
    windows, horizon, states = joined.shape
    if windows < FEWEST_WINDOWS:
        raise OdisarError(
            f"{windows} windows cannot say how often forecasts hold; give at least "
            f"{FEWEST_WINDOWS} that share no forecast sample, from more held-out recordings"
        )
    if not 1 <= step_groups <= horizon:
        raise OdisarError(f"{step_groups} step groups don't divide {horizon} steps; take fewer")
    groups = np.array_split(np.arange(horizon), step_groups)
    maps = [[_fit_map(joined[:, steps, state]) for state in range(states)] for steps in groups]
    return Recalibration(tuple(tuple(row) for row in maps), horizon, windows)


def predictive_distributions(
    draws: NDArray[np.floating[Any]], noise: NoiseFloor, recalibration: Recalibration
) -> dict[str, GaussianForecast | RecalibratedForecast]:
    """Return by name the distributions that (draw, window, step, state) draws give rise to."""
    plain = draws_only(draws)
    noisy = with_noise(plain, noise)
    return {
        DRAWS: plain,
        DRAWS_PLUS_NOISE: noisy,
        RECALIBRATED: RecalibratedForecast(noisy, recalibration),
    }


def _fit_map(levels: FloatArray) -> LevelMap:
    known = np.sort(levels[np.isfinite(levels)])
    if known.size < FEWEST_WINDOWS:
        raise OdisarError(
            f"{known.size} known truths of a state cannot say how often forecasts hold; add "
            "held-out recordings or leave the state out"
        )
    frequencies = np.arange(1, known.size + 1) / (known.size + 1)
    fitted = IsotonicRegression().fit(np.clip(known, _END, 1 - _END), frequencies)
    predicted, observed = fitted.X_thresholds_, fitted.y_thresholds_
    kept = np.unique(np.linspace(0, len(predicted) - 1, _KNOTS).round().astype(int))
    return LevelMap(
        np.concatenate([[0.0], predicted[kept], [1.0]]),
        np.concatenate([[0.0], observed[kept], [1.0]]),
    )


def _read_map(content: Mapping[str, Any]) -> LevelMap:
    knots = LevelMap(*(np.array(content[k], dtype=np.float64) for k in ("predicted", "observed")))
    for values in (knots.predicted, knots.observed):
        rises = values.ndim == 1 and len(values) > 1 and bool((np.diff(values) > 0).all())
        if not rises or values[0] != 0 or values[-1] != 1:
            raise ValueError("knots must rise from 0 to 1")
    if len(knots.predicted) != len(knots.observed):
        raise ValueError(f"{len(knots.predicted)} levels for {len(knots.observed)} frequencies")
    return knots


def _standard_quantiles(level_map: LevelMap, frequencies: FloatArray) -> FloatArray:
    """Return (frequency,) quantiles in standard deviations of the base from its mean."""
    return np.asarray(ndtri(level_map.levels(frequencies)), dtype=np.float64)


def _quantile_crps(quantiles: FloatArray, scores: FloatArray) -> FloatArray:
    """Return (...) twice the mean pinball loss of sorted (level,) midpoint quantiles.

    For midpoints the sum is that of an ensemble of the quantiles: mean distance to the truth less
    half the mean distance between two of them. Running sums replace a loop over levels.
    """
    count = len(quantiles)
    sums = np.concatenate([[0.0], np.cumsum(quantiles)])
    below = np.searchsorted(quantiles, scores)
    to_truth = scores * (2 * below - count) + sums[-1] - 2 * sums[below]
    between = (2 * np.arange(count) - count + 1) @ quantiles
    return np.asarray((to_truth - between / count) / count)
