"""Noise of one sensor: samples that were off by themselves, which the next forecast pays for.

A sample that reads wrong shows twice: in its own innovation, and with the other sign in the next
one, whose forecast was made from it (an additive outlier: Fox, J. Royal Statistical Society B 1972;
Chen and Liu, J. American Statistical Association 1993). What the machine does, shows once. A filter
that is matched to both tells a noisy sensor from weather and manoeuvres of the same size, and from
their heavy tails. It looks back one sample: one must have come after the wrong one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from odisar.capability.innovations import (
    FloatArray,
    LogScale,
    held_to_newer,
    moving_mean,
    newer_half,
)
from odisar.capability.responses import StepResponse, state_directions
from odisar.recordings.schema import Recording
from odisar.twin.bundle import TrainedTwin
from odisar.windows.coordinates import POSE_RATES

#: A direction that is not seen at all explains nothing; keeps 0 / 0 out in any unit.
_SMALLEST = np.finfo(np.float64).tiny
#: Samples whose responses are in memory at a time.
_CHUNK = 512
#: Of the states that can be blamed the first three are a pose, where there is one.
_POSE = slice(POSE_RATES)


@dataclass(frozen=True)
class OutlierFilter:
    """What one wrong sample of each state would leave in two innovations of the closed form.

    Of a relative pose a wrong position is two wrong rates, taken as equal, opposite and along the
    axes of the earlier heading: where stamps jitter or the machine turns, nearly so.
    """

    twin: TrainedTwin
    response: StepResponse

    @classmethod
    def of(cls, twin: TrainedTwin) -> Self:
        """Return the filter of a twin."""
        return cls(twin, StepResponse.of(twin))

    def squares(
        self,
        recording: Recording,
        positions: NDArray[np.int64],
        innovations: FloatArray,
        samples: NDArray[np.floating],
        precision: FloatArray,
    ) -> FloatArray:
        """Return (window, state) how well a wrong sample explains the last two innovations.

        Squares of the matched filter's output in its variances, chi-square with one degree of
        freedom where all is well; those at a window ask whether the sample before it was wrong.
        ``positions`` (window,) are those of one gapless run, ``innovations`` (window, state
        feature) the closed form's there, ``samples`` (window, feature) scaled, ``precision`` the
        inverse covariance of single innovations. NaN until two innovations are known.
        """
        states = precision.shape[0]
        squares = np.full((len(positions), states), np.nan)
        for start in range(1, len(positions), _CHUNK):
            now = np.arange(start, min(start + _CHUNK, len(positions)))
            first = state_directions(self.twin, recording, positions[now - 1])
            second = -first @ self.response.carried(samples[now - 1]).transpose(0, 2, 1)
            if self.twin.spec.pose is not None:
                # A wrong position is two wrong rates, to it and back from it.
                second[:, _POSE] -= first[:, _POSE]
            output, size = (
                (first @ precision * before + second @ precision * after).sum(axis=-1)
                for before, after in (
                    (innovations[now - 1, None], innovations[now, None]),
                    (first, second),
                )
            )
            squares[now] = output**2 / np.maximum(size, _SMALLEST)
        return squares


@dataclass(frozen=True)
class NoiseSteps:
    """How the score of noise is put together (``score.noise`` of a case in params.yaml).

    ``lasting`` and ``recent`` are numbers of samples, ``recent_share`` the weight of the latter;
    ``margin`` is how much further out than elsewhere it must be, on the common log scale; below
    zero, how much less far.
    """

    lasting: int
    recent: int
    recent_share: float
    margin: float


@dataclass(frozen=True)
class SensorNoise:
    """How noisy the noisiest state is: on the common log scale, less a margin.

    What lasts counts hardly more than in the ``newer`` half of its window: noise that only the
    older half holds is over.
    """

    steps: NoiseSteps
    lasting: LogScale
    newer: LogScale
    recent: LogScale

    @property
    def known_after_steps(self) -> int:
        """How many steps after its first forecast a run has its first score."""
        return max(self.steps.lasting, self.steps.recent) + 1

    @classmethod
    def fit(cls, runs: Sequence[FloatArray], steps: NoiseSteps) -> Self:
        """Fit on gapless runs (time, state) of squares of held-out recordings."""
        scales = (
            LogScale.fit(np.concatenate([_noisiest(run, count) for run in runs]))
            for count in (steps.lasting, newer_half(steps.lasting), steps.recent)
        )
        return cls(steps, *scales)

    def score(self, squares: FloatArray) -> FloatArray:
        """Return (time,) along one gapless run of squares (time, state); NaN until it is known."""
        steps = self.steps
        whole = self.lasting.of(_noisiest(squares, steps.lasting))
        newer = self.newer.of(_noisiest(squares, newer_half(steps.lasting)))
        lasting = held_to_newer(whole, newer)
        recent = self.recent.of(_noisiest(squares, steps.recent))
        mixed = (1 - steps.recent_share) * lasting + steps.recent_share * recent
        return np.asarray(mixed - steps.margin)


def _noisiest(squares: FloatArray, steps: int) -> FloatArray:
    """Return (time,) the largest, over states, of the mean of log(1 + square)."""
    return np.asarray(moving_mean(np.log1p(squares), steps).max(axis=1))
