"""Innovations: what the twin said about now, against what is observed now.

At time t the forecast of x(t) that was made from samples up to t - 1 is compared with x(t): the
innovation of state estimation (Bar-Shalom, Li and Kirubarajan, 2001, section 5.4). Two statistics
of the last innovations look for two kinds of change: T2 of their mean (Hotelling, 1947) grows when
they lean one way (a bias, a current), the size of the one that scatters most, given all others,
when a sensor gets noisy. A single one that stands out, such as the start of a manoeuvre leaves, is
cut back before the mean is taken. Their covariance comes from recordings that no weight was fitted
to. Each statistic, and beside them the reconstruction error of the twin's own forecast (the paper's
score), is put on the same scale, its log against what is usual on those recordings, and the largest
one counts: a user need not know in advance which kind of change will come.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from odisar.config.score import FEWEST_KNOWN
from odisar.errors import OdisarError

FloatArray = NDArray[np.float64]

#: Added to a covariance, as a share of its mean variance: keeps a state that hardly moves from
#: making it singular.
_SHRINKAGE = 1.0e-6
#: What is usual and what is rare on held-out recordings: 0 and 1 on the common scale.
_USUAL, _RARE = 0.5, 0.99
#: Single innovations further out than this share of held-out ones are cut back.
_OUTLYING = 0.95
#: How much rarer a statistic may be than the same of the newer half of its window, on the common
#: scale: what lasts shows there as well, by a little less as fewer innovations say so.
_BEYOND_NEWER = 0.5
#: Below it a statistic is called zero; its log must stay finite.
_SMALLEST = 1.0e-12


def moving_mean(values: FloatArray, steps: int) -> FloatArray:
    """Return (time, ...) the mean of the last ``steps`` values; NaN where one is missing."""
    means = np.full_like(values, np.nan)
    if len(values) < steps:
        return means
    view = np.lib.stride_tricks.sliding_window_view(values, steps, axis=0)
    means[steps - 1 :] = view.mean(axis=-1)
    return means


def squared_distance(values: FloatArray, precision: FloatArray) -> FloatArray:
    """Return (time,) squared Mahalanobis distances from zero of (time, feature) values."""
    return np.asarray(np.einsum("ti,ij,tj->t", values, precision, values))


def conditional_squares(values: FloatArray, precision: FloatArray) -> FloatArray:
    """Return (time, feature) squares of each feature given all others, in their variances.

    The conditional terms of T2 (Mason, Tracy and Young, J. Quality Technology 1995): what a state
    does that the others, which physics ties to it, do not account for.
    """
    return np.asarray((values @ precision) ** 2 / np.diag(precision))


def fit_precision(values: FloatArray) -> FloatArray:
    """Return (feature, feature) the inverse second moment about zero of (time, feature) values.

    About zero, as an innovation should have no mean: one on held-out recordings is an error too.
    """
    known = values[np.isfinite(values).all(axis=1)]
    if len(known) <= values.shape[1]:
        raise OdisarError(
            f"{len(known)} innovations cannot give the covariance of {values.shape[1]} states; "
            "add validation recordings or shorten the windows of the score (cases.*.score)"
        )
    moment = known.T @ known / len(known)
    if not moment.any():
        raise OdisarError(
            "no state ever differs from what is said of it on validation recordings: nothing there "
            "moves; add recordings of the machine at work"
        )
    moment += _SHRINKAGE * np.trace(moment) / len(moment) * np.eye(len(moment))
    return np.asarray(np.linalg.inv(moment))


@dataclass(frozen=True)
class LogScale:
    """The log of a statistic: 0 where held-out recordings usually are, 1 where they rarely are."""

    usual: float
    rare: float

    @classmethod
    def fit(cls, statistic: FloatArray) -> Self:
        """Fit on (time,) values of held-out recordings; NaN don't count."""
        known = statistic[np.isfinite(statistic)]
        if len(known) < FEWEST_KNOWN:
            raise OdisarError(
                f"{len(known)} samples of validation recordings lie behind the windows of the "
                f"score, and at least {FEWEST_KNOWN} must, or nobody knows what is usual; shorten "
                "them (the steps in cases.*.score of params.yaml), or add longer validation "
                "recordings"
            )
        logs = np.log(np.maximum(known, _SMALLEST))
        usual, rare = np.quantile(logs, [_USUAL, _RARE])
        return cls(float(usual), float(max(rare, usual + 1e-6)))

    def of(self, statistic: FloatArray) -> FloatArray:
        """Return (time,) on the scale."""
        logs = np.log(np.maximum(statistic, _SMALLEST))
        return np.asarray((logs - self.usual) / (self.rare - self.usual))


@dataclass(frozen=True)
class InnovationLimit:
    """How far from zero, by Mahalanobis distance, a single innovation may count.

    Huber's psi for vectors (Maronna, Annals of Statistics 1976): what lies further out keeps its
    direction and is drawn in to the limit. One start or stop no longer rules a mean for as long as
    it is in the window; a lasting change shows in every sample and is seen as soon, though a large
    one no longer counts for more than a moderate one.
    """

    precision: FloatArray
    distance: float

    @classmethod
    def fit(cls, runs: Sequence[FloatArray]) -> Self:
        """Fit on gapless runs (time, state) of held-out innovations."""
        every = np.concatenate(list(runs))
        precision = fit_precision(every)
        squares = squared_distance(every, precision)
        return cls(precision, float(np.sqrt(np.quantile(squares[np.isfinite(squares)], _OUTLYING))))

    def of(self, innovations: FloatArray) -> FloatArray:
        """Return (time, state) innovations, none of them further out than the limit."""
        distances = np.sqrt(squared_distance(innovations, self.precision))
        return (
            innovations * np.minimum(1.0, self.distance / np.maximum(distances, _SMALLEST))[:, None]
        )


@dataclass(frozen=True)
class MeanInnovation:
    """T2 of the mean of the last ``steps`` innovations; ``precision`` (state, state) is its own.

    Single ones are cut back to ``limit``, if there is one.
    """

    steps: int
    precision: FloatArray
    scale: LogScale
    limit: InnovationLimit | None

    @classmethod
    def fit(cls, runs: Sequence[FloatArray], steps: int, limit: InnovationLimit | None) -> Self:
        """Fit on gapless runs (time, state) of held-out innovations."""
        means = np.concatenate([_means(run, steps, limit) for run in runs])
        precision = fit_precision(means)
        return cls(steps, precision, LogScale.fit(squared_distance(means, precision)), limit)

    def means(self, innovations: FloatArray) -> FloatArray:
        """Return (time, state) means along one gapless run; NaN until enough are known."""
        return _means(innovations, self.steps, self.limit)

    def statistic(self, innovations: FloatArray) -> FloatArray:
        """Return (time,) T2 along one gapless run (time, state); NaN until enough are known."""
        return squared_distance(self.means(innovations), self.precision)


def _means(innovations: FloatArray, steps: int, limit: InnovationLimit | None) -> FloatArray:
    return moving_mean(innovations if limit is None else limit.of(innovations), steps)


@dataclass(frozen=True)
class InnovationSize:
    """How much one state scatters: the largest, over states, of a mean over the last ``steps``.

    The mean is of log(1 + square of the state's innovation given all others). Looked at one by
    one, a noisy sensor is not diluted by those that are well; the log keeps a single start or
    stop, which no twin forecasts, from ruling the mean.
    """

    steps: int
    precision: FloatArray
    scale: LogScale

    @classmethod
    def fit(cls, runs: Sequence[FloatArray], steps: int) -> Self:
        """Fit on gapless runs (time, state) of held-out innovations."""
        precision = fit_precision(np.concatenate(list(runs)))
        sizes = [cls._of(run, precision, steps) for run in runs]
        return cls(steps, precision, LogScale.fit(np.concatenate(sizes)))

    def statistic(self, innovations: FloatArray) -> FloatArray:
        """Return (time,) along one gapless run (time, state); NaN until enough are known."""
        return self._of(innovations, self.precision, self.steps)

    @staticmethod
    def _of(innovations: FloatArray, precision: FloatArray, steps: int) -> FloatArray:
        squares = np.log1p(conditional_squares(innovations, precision))
        return np.asarray(moving_mean(squares, steps).max(axis=1))


def newer_half(steps: int) -> int:
    """Return how many steps are the newer half of a window; of an odd number, the larger one."""
    return (steps + 1) // 2


def held_to_newer(whole: FloatArray, newer: FloatArray) -> FloatArray:
    """Return (time,) a statistic on the log scale, hardly more than of its window's newer half."""
    return np.minimum(whole, newer + _BEYOND_NEWER)


@dataclass(frozen=True)
class InnovationSteps:
    """How the score is put together (``score`` of a case in params.yaml).

    ``mean``, ``size`` and ``recent`` are numbers of innovations, ``recent_share`` is the weight of
    the last statistic.
    """

    mean: int
    size: int
    recent: int
    recent_share: float


@dataclass(frozen=True)
class InnovationScore:
    """A score of innovations, as exp of a weighted sum of statistics on their common log scale.

    What it says of innovations holds of parity residuals as well (``consistency``).
    The largest of T2 of the mean innovation, the size of the innovations of the state that scatters
    most and, where there is one, the reconstruction error of the forecast (``reconstruction`` is
    its scale), which notices what any of them does; and, with weight ``recent_share``, T2 of the
    mean of very few innovations, which lets go as soon as a disturbance has ended. Mean and size
    count hardly more than the same of the ``newer`` half of their windows: what only the older half
    holds is over. 1 is what is usual on held-out recordings, e = 2.7 what is rare. The monitor's
    mean has three of these (see ``combined.MeanParts``).
    """

    mean: MeanInnovation
    size: InnovationSize
    newer_mean: MeanInnovation
    newer_size: InnovationSize
    recent: MeanInnovation
    recent_share: float
    reconstruction: LogScale | None

    @property
    def known_after_steps(self) -> int:
        """How many steps after its first forecast a run has its first score."""
        return max(self.mean.steps, self.size.steps, self.recent.steps)

    @classmethod
    def fit(
        cls,
        runs: Sequence[FloatArray],
        reconstructions: Sequence[FloatArray] | None,
        steps: InnovationSteps,
    ) -> Self:
        """Fit on gapless runs of held-out recordings.

        ``runs`` are innovations (time, state), ``reconstructions`` reconstruction errors (time,).
        """
        scale = None if reconstructions is None else LogScale.fit(np.concatenate(reconstructions))
        limit = InnovationLimit.fit(runs)
        return cls(
            MeanInnovation.fit(runs, steps.mean, limit),
            InnovationSize.fit(runs, steps.size),
            MeanInnovation.fit(runs, newer_half(steps.mean), limit),
            InnovationSize.fit(runs, newer_half(steps.size)),
            # Of so few the last one has to count for what it is.
            MeanInnovation.fit(runs, steps.recent, None),
            steps.recent_share,
            scale,
        )

    def parts(self, innovations: FloatArray) -> FloatArray:
        """Return (2, time) mean and size on their common log scale along one gapless run."""
        pairs = ((self.mean, self.newer_mean), (self.size, self.newer_size))
        return np.stack(
            [
                held_to_newer(*(part.scale.of(part.statistic(innovations)) for part in pair))
                for pair in pairs
            ]
        )

    def score(self, innovations: FloatArray, reconstruction: FloatArray) -> FloatArray:
        """Return (time,) scores along one gapless run; NaN until all statistics are known.

        ``innovations`` (time, state) and ``reconstruction`` (time,) errors, scaled.
        """
        lasting = self.parts(innovations).max(axis=0)
        if self.reconstruction is not None:
            lasting = np.maximum(lasting, self.reconstruction.of(reconstruction))
        recent = self.recent.scale.of(self.recent.statistic(innovations))
        share = self.recent_share
        return np.asarray(np.exp((1 - share) * lasting + share * recent))
