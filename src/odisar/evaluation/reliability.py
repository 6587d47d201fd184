"""Whether forecasts hold as often as they promise, and how much they promise.

Calibration: a truth lies below the forecast's quantile at p in a share p of all cases (Kuleshov,
Fenner and Ermon, ICML 2018). Sharpness: how narrow the forecast is. The continuous ranked
probability score (CRPS) asks for both at once (Gneiting and Raftery, JASA 2007).

All of them are ratios of sums, or functions of such: one tally per recording is enough for the
value and, by resampling clusters of recordings, for its interval. Windows, steps and states of a
recording depend on one another, so nothing is resampled below a recording.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.config.judging import EvaluationConfig
from odisar.errors import OdisarError
from odisar.evaluation.intervals import Resampler
from odisar.seeding import generator

FloatArray = NDArray[np.float64]

#: Probabilities that central intervals promise.
COVERAGES = (0.5, 0.8, 0.9, 0.95)
#: Levels of the reliability curve: 0.05, 0.10, ..., 0.95.
CURVE_LEVELS = tuple(round(0.05 * i, 2) for i in range(1, 20))
#: The row over all states together.
ALL_STATES = "all"
#: The distribution that the CRPS of the draws themselves belongs to.
DRAWS = "draws"

RELIABILITY_COLUMNS = (
    "setup",
    "distribution",
    "state",
    "metric",
    "value",
    "ci_low",
    "ci_high",
    "windows",
)
CURVE_COLUMNS = ("setup", "distribution", "state", "level", "observed", "ci_low", "ci_high")

# Every level of the curve and both ends are among them.
_GRID = np.arange(101) / 100
_ON_CURVE = [5 * i for i in range(1, 20)]
_PHYSICAL = ("sharpness", "crps", "crps-ensemble")


class Predictive(Protocol):
    """A predictive distribution per window, step and state, in scaled units."""

    @property
    def std(self) -> FloatArray:
        """Standard deviation (window, step, state)."""
        ...

    def levels(self, truth: NDArray[np.floating[Any]]) -> FloatArray:
        """Return (window, step, state) the cumulative probability of the truth."""
        ...

    def crps(self, truth: NDArray[np.floating[Any]]) -> FloatArray:
        """Return (window, step, state) the CRPS."""
        ...


@dataclass(frozen=True)
class RecordingForecasts:
    """What was forecast in one recording, and what came.

    ``cluster`` is shared by recordings that depend on one another. ``truth`` (window, step, state)
    is scaled, NaN where unknown; ``distributions`` are those to compare, by name. With ``draws``
    (draw, window, step, state) the distribution called ``draws`` gets their own CRPS as well.
    """

    name: str
    cluster: str
    truth: FloatArray
    distributions: Mapping[str, Predictive]
    draws: NDArray[np.floating[Any]] | None = None


def ensemble_crps(
    draws: NDArray[np.floating[Any]], truth: NDArray[np.floating[Any]], *, fair: bool
) -> FloatArray:
    """Return (window, step, state) the CRPS of (draw, window, step, state) draws as they are.

    Plain: of the steps that the draws make, as if they were the whole distribution. Fair (Ferro,
    QJRMS 2014): of the distribution that they come from, without a fine for being few.
    """
    count = len(draws)
    ordered = np.sort(np.asarray(draws, dtype=np.float64), axis=0)
    to_truth = np.abs(ordered - truth).mean(axis=0)
    rank_weights = 2 * np.arange(count) - count + 1
    between = np.tensordot(rank_weights, ordered, axes=1) / (count * (count - 1 if fair else count))
    return np.asarray(to_truth - between)


def interval_levels(levels: FloatArray) -> FloatArray:
    """Return (...) the smallest central interval, by its probability, that holds the truth."""
    return np.abs(2 * levels - 1)


def observed_shares(levels: FloatArray, expected: FloatArray) -> FloatArray:
    """Return (level,) the share of known levels, of any shape, at or below each expected one."""
    known = np.sort(levels[np.isfinite(levels)])
    return np.searchsorted(known, expected, side="right") / known.size


def miscalibration_area(expected: FloatArray, observed: FloatArray) -> FloatArray:
    """Return (...) the area between (..., level) observed shares and the diagonal.

    Between two of the (level,) expected levels the curve is straight; where it crosses the
    diagonal both triangles count. 0 is perfect, 0.5 the worst there is.
    """
    left, right = np.abs(observed - expected)[..., :-1], np.abs(observed - expected)[..., 1:]
    signs = np.sign(observed - expected)
    crosses = signs[..., :-1] * signs[..., 1:] < 0
    total = np.where(crosses, left + right, 1.0)
    height = np.where(crosses, (left**2 + right**2) / total, left + right) / 2
    return np.asarray((height * np.diff(expected)).sum(axis=-1))


def reliability_table(
    setup: str,
    parts: Sequence[RecordingForecasts],
    states: Sequence[str],
    cfg: EvaluationConfig,
    base_seed: int,
    *,
    scale: FloatArray | None = None,
) -> pd.DataFrame:
    """Return coverage, miscalibration, sharpness and CRPS per distribution and state, and pooled.

    ``coverage-C`` is the share of truths inside the central interval of probability C;
    ``miscalibration`` the area between the curve of quantile levels and the diagonal; ``sharpness``
    the mean standard deviation; ``crps`` the mean of the distribution's own; ``crps-ensemble`` that
    of the draws, fair. With the ``scale`` (state,) of the states in physical units, sharpness and
    CRPS stand there a second time, per state, as ``...-physical``.

    Pooled (state ``all``) are the cases of all states in one heap, so opposite errors of two
    states cancel in it. An area is never negative: where it is about zero its interval lies a
    little high. Intervals hold the noise and the recalibration fixed, as a user meets them.

    Raises OdisarError where there is no recording, or recordings and states don't fit.
    """
    _check(parts, states, scale)
    rows = []
    for name in parts[0].distributions:
        tallies, resampler = _tallied(parts, name, cfg, base_seed)
        found, drawn = _metrics(tallies.sum(axis=0)), _metrics(resampler.totals(tallies))
        for metric, values in found.items():
            for state, factor, called in _rows_of(metric, states, scale):
                low, high = resampler.interval(drawn[metric][:, state] * factor)
                label = states[state] if state < len(states) else ALL_STATES
                value = float(values[state]) * factor
                windows = sum(len(part.truth) for part in parts)
                rows.append((setup, name, label, called, value, low, high, windows))
    return pd.DataFrame(rows, columns=list(RELIABILITY_COLUMNS))


def reliability_curves(
    setup: str,
    parts: Sequence[RecordingForecasts],
    states: Sequence[str],
    cfg: EvaluationConfig,
    base_seed: int,
) -> pd.DataFrame:
    """Return how often the truth was at or below the quantile at each of 19 levels.

    One row per distribution, state (and all of them pooled) and level. Raises OdisarError where
    there is no recording, or recordings and states don't fit.
    """
    _check(parts, states, None)
    rows = []
    for name in parts[0].distributions:
        tallies, resampler = _tallied(parts, name, cfg, base_seed)
        observed, drawn = (
            _curve(totals)[..., _ON_CURVE]
            for totals in (tallies.sum(axis=0), resampler.totals(tallies))
        )
        for state, label in enumerate([*states, ALL_STATES]):
            for i, level in enumerate(CURVE_LEVELS):
                low, high = resampler.interval(drawn[:, state, i])
                rows.append((setup, name, label, level, float(observed[state, i]), low, high))
    return pd.DataFrame(rows, columns=list(CURVE_COLUMNS))


def _check(
    parts: Sequence[RecordingForecasts], states: Sequence[str], scale: FloatArray | None
) -> None:
    if not parts:
        raise OdisarError("no recording's forecasts to judge; forecast at least one recording")
    for part in parts:
        if part.truth.ndim != 3 or part.truth.shape[-1] != len(states):
            raise OdisarError(
                f"{part.name}: truths of shape {part.truth.shape} are not (window, step, state) of "
                f"{len(states)} states; name the states that the twin forecasts"
            )
        if list(part.distributions) != list(parts[0].distributions):
            raise OdisarError(
                f"{part.name}: distributions {list(part.distributions)}, but {parts[0].name} has "
                f"{list(parts[0].distributions)}; give every recording the same ones"
            )
    if scale is not None and scale.shape != (len(states),):
        raise OdisarError(f"a scale of shape {scale.shape} for {len(states)} states; give one each")


def _tallied(
    parts: Sequence[RecordingForecasts], name: str, cfg: EvaluationConfig, base_seed: int
) -> tuple[FloatArray, Resampler]:
    """Return (recording, tally, state + 1) sums, those over states last, and the resampler.

    The seed's name leaves out set-up and distribution: they are compared on the same draws.
    """
    tallies = np.stack([_tally(part, name) for part in parts])
    pooled = np.concatenate([tallies, tallies.sum(axis=-1, keepdims=True)], axis=-1)
    rng = generator(base_seed, "evaluation", "reliability")
    clusters = [part.cluster for part in parts]
    return pooled, Resampler.draw(clusters, cfg.bootstrap_draws, cfg.confidence, rng)


def _tally(part: RecordingForecasts, name: str) -> FloatArray:
    """Return (tally, state) sums over a recording's windows and steps with a known truth.

    In order: cases, cases at or below each level of the grid, cases inside each central interval,
    standard deviation, CRPS, and the CRPS of the draws where they are judged.
    """
    forecast, truth = part.distributions[name], part.truth
    levels = forecast.levels(truth)
    reached = [levels <= level for level in _GRID]
    reached += [interval_levels(levels) <= coverage for coverage in COVERAGES]
    amounts = [forecast.std, forecast.crps(truth)]
    if name == DRAWS and part.draws is not None:
        amounts.append(ensemble_crps(part.draws, truth, fair=True))
    known = np.isfinite(truth)
    sums = [np.where(known, item, 0.0).sum(axis=(0, 1)) for item in [known, *reached, *amounts]]
    return np.stack(sums)


def _metrics(totals: FloatArray) -> dict[str, FloatArray]:
    """Return by name (..., state) values from (..., tally, state) totals."""
    after_grid = 1 + len(_GRID)
    names = [f"coverage-{c:g}" for c in COVERAGES] + ["sharpness", "crps", "crps-ensemble"]
    shares = _shares(totals)[..., after_grid:, :]
    metrics = {"miscalibration": miscalibration_area(_GRID, _curve(totals))}
    # Distributions without draws of their own have one tally less.
    return metrics | {n: shares[..., i, :] for i, n in enumerate(names[: shares.shape[-2]])}


def _curve(totals: FloatArray) -> FloatArray:
    """Return (..., state, level) observed shares over the grid."""
    return np.moveaxis(_shares(totals)[..., 1 : 1 + len(_GRID), :], -2, -1)


def _shares(totals: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(totals / totals[..., :1, :])


def _rows_of(
    metric: str, states: Sequence[str], scale: FloatArray | None
) -> list[tuple[int, float, str]]:
    """Return state (one past the last: all of them), factor and name of each row of a metric."""
    rows = [(state, 1.0, metric) for state in range(len(states) + 1)]
    if scale is not None and metric in _PHYSICAL:
        rows += [(i, float(factor), f"{metric}-physical") for i, factor in enumerate(scale)]
    return rows
