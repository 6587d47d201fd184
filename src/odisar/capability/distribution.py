"""The predictive distribution of a forecast: spread over draws, and noise that draws don't show.

Dropout draws differ because the network is uncertain (epistemic). What no network could foresee
(aleatoric) isn't in them, so draws alone promise too narrow an interval (Gal and Ghahramani, ICML
2016, add a constant noise for the same reason). Here the noise is one variance per step and state,
from recordings that were not trained on.

Everything is in scaled units. Arrays are (window, step, state), draws (draw, window, step, state).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from odisar.errors import OdisarError
from odisar.recordings.schema import Recording
from odisar.windows.windowing import WindowSpec

FloatArray = NDArray[np.float64]

# Where draws spread more than the errors, nothing is left for the noise. A small share of the
# error stays, so that windows on which all draws agree are not promised to be exact.
_SMALLEST_NOISE_SHARE = 0.01
#: Scaled states have variance 1; a state that never moves keeps an interval of some width.
_SMALLEST_NOISE = 1e-12


@dataclass(frozen=True)
class GaussianForecast:
    """A normal distribution per window, step and state.

    ``mean`` and ``variance`` are (window, step, state); a variance may be zero, which is a step
    at the mean.
    """

    mean: FloatArray
    variance: FloatArray

    @property
    def std(self) -> FloatArray:
        """Standard deviation (window, step, state)."""
        return np.sqrt(self.variance)

    def standard_scores(self, truth: NDArray[np.floating[Any]]) -> FloatArray:
        """Return (window, step, state) how many standard deviations the truth lies above the mean.

        Infinite where the variance is zero and the truth elsewhere; NaN where the truth is.
        """
        error = truth - self.mean
        with np.errstate(divide="ignore", invalid="ignore"):
            scores = error / self.std
        return np.where((error == 0) & (self.variance == 0), 0.0, scores)

    def levels(self, truth: NDArray[np.floating[Any]]) -> FloatArray:
        """Return (window, step, state) the cumulative probability of the truth, 0 to 1."""
        return np.asarray(ndtr(self.standard_scores(truth)), dtype=np.float64)

    def quantiles(self, level: float) -> FloatArray:
        """Return (window, step, state) what the truth stays below with probability ``level``."""
        return self.mean + self.std * float(ndtri(level))

    def crps(self, truth: NDArray[np.floating[Any]]) -> FloatArray:
        """Return (window, step, state) the continuous ranked probability score; lower is better.

        Closed form of the normal distribution (Gneiting and Raftery, JASA 2007, section 4.2), with
        the sign turned. It is the absolute error where the variance is zero.
        """
        scores = self.standard_scores(truth)
        density = np.exp(-0.5 * scores**2) / np.sqrt(2 * np.pi)
        away = (truth - self.mean) * (2 * ndtr(scores) - 1)
        return np.asarray(away + self.std * (2 * density - 1 / np.sqrt(np.pi)), dtype=np.float64)


@dataclass(frozen=True)
class NoiseFloor:
    """Variance (step, state) that a forecast has even where all draws agree, scaled units squared.

    ``windows`` is how many held-out windows it was estimated on.
    """

    variance: FloatArray
    windows: int

    def as_json(self) -> dict[str, Any]:
        """Return the noise as JSON types."""
        return {"variance": self.variance.tolist(), "windows": self.windows}

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Self:
        """Return the noise that ``as_json`` described; raise OdisarError where it can't be one."""
        try:
            noise = cls(np.array(content["variance"], dtype=np.float64), int(content["windows"]))
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise OdisarError(
                f"not a noise floor ({error}); fit it again on held-out data"
            ) from error
        known = np.isfinite(noise.variance) & (noise.variance > 0)
        if noise.variance.ndim != 2 or not known.all():
            raise OdisarError(
                "a noise floor must be (step, state) finite variances above zero; fit it again on "
                "held-out data"
            )
        return noise


def draws_only(draws: NDArray[np.floating[Any]]) -> GaussianForecast:
    """Return mean and population variance over draws, as the paper has it (Eq. (variance)).

    ``draws`` is (draw, window, step, state). Nothing stands for noise here.
    """
    exact = np.asarray(draws, dtype=np.float64)
    return GaussianForecast(exact.mean(axis=0), exact.var(axis=0))


def with_noise(forecast: GaussianForecast, noise: NoiseFloor) -> GaussianForecast:
    """Return the forecast with the noise of every step and state added to its variance.

    Raises OdisarError where the noise is of another horizon or other states.
    """
    if forecast.variance.shape[1:] != noise.variance.shape:
        raise OdisarError(
            f"a noise floor of (step, state) {noise.variance.shape} doesn't fit forecasts of "
            f"{forecast.variance.shape[1:]}; fit it on forecasts of the same twin"
        )
    return GaussianForecast(forecast.mean, forecast.variance + noise.variance)


def fit_noise(
    forecasts: Sequence[GaussianForecast], truths: Sequence[NDArray[np.floating[Any]]]
) -> NoiseFloor:
    """Return per step and state the mean squared error of the mean less the mean draw variance.

    ``forecasts`` (from ``draws_only``) and ``truths`` (window, step, state) belong to undisturbed
    recordings that the twin wasn't trained on, one item a recording; NaN truths don't count.
    The noise is never below a hundredth of the mean squared error.

    Raises OdisarError where a step of a state has no known truth at all.
    """
    errors = [truth - forecast.mean for forecast, truth in zip(forecasts, truths, strict=True)]
    joined = np.concatenate(errors) if errors else np.empty((0, 1, 1))
    known = np.isfinite(joined)
    count = known.sum(axis=0)
    if not count.all():
        raise OdisarError(
            f"{len(joined)} held-out windows leave a step of a state without any known truth, so "
            "its noise is unknown; add held-out recordings or shorten the horizon"
        )
    spread = np.concatenate([forecast.variance for forecast in forecasts])
    squared_error = np.where(known, joined, 0.0) ** 2
    mean_squared_error = squared_error.sum(axis=0) / count
    left = mean_squared_error - np.where(known, spread, 0.0).sum(axis=0) / count
    smallest = np.maximum(_SMALLEST_NOISE_SHARE * mean_squared_error, _SMALLEST_NOISE)
    return NoiseFloor(np.maximum(left, smallest), len(joined))


def disjoint_positions(recording: Recording, spec: WindowSpec) -> NDArray[np.int64]:
    """Return (window,) positions of issue one horizon apart, with their whole horizon observed.

    No sample is forecast twice by these windows. Forecasts issued at neighbouring samples err
    alike, so counting all of them would only pretend to know more.
    """
    parts = [spec.issue_positions(segment, spec.horizon_steps) for segment in recording.segments]
    return np.concatenate([np.empty(0, dtype=np.int64), *parts])
