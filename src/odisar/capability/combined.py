"""The monitor's score: what innovations, parity residuals and single sensors say together."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from odisar.capability.consistency import Consistency
from odisar.capability.innovations import (
    FloatArray,
    InnovationScore,
    InnovationSize,
    InnovationSteps,
    LogScale,
)
from odisar.capability.outliers import NoiseSteps, SensorNoise
from odisar.capability.release import Release
from odisar.capability.shifts import ShiftSteps, StateShift

#: The monitor's score, and the same without its Transformer.
ODISAR, WITHOUT_TRANSFORMER = "odisar", "without-transformer"
#: What these are made of: innovations of the closed form (and their scatter), parity residuals.
CLOSED_FORM, CONSISTENCY = "closed-form", "consistency"
#: Detectors whose means are put on the common log scale and let go of what is over.
RELEASED = (ODISAR, WITHOUT_TRANSFORMER, CLOSED_FORM)

#: Scatter counts no more than this, what is rare, on the common log scale.
SATURATED = 1.0
#: What scores of ``RELEASED`` rarely are on held-out recordings.
RARE = float(np.e)
#: However far out a statistic is, or has been before it was let go of, its score stays finite and
#: above zero in single precision, and so in JSON.
_SMALLEST, _LARGEST = 1.0e-30, 1.0e30


@dataclass(frozen=True)
class Run:
    """What is known along one gapless run.

    ``innovations`` of the twin and ``closed_form`` are (window, state feature), ``samples``
    (window, feature), ``reconstruction`` errors (window,). ``outliers`` returns (window, state)
    squares of the outlier filter, given the precision of the closed form's innovations; ``shifts``
    (window,) ratios of the shift filter, given innovations, their precision and a memory.
    """

    innovations: FloatArray
    closed_form: FloatArray
    samples: NDArray[np.float32]
    reconstruction: FloatArray
    outliers: Callable[[FloatArray], FloatArray]
    shifts: Callable[[FloatArray, FloatArray, int], FloatArray]


@dataclass(frozen=True)
class ScoreSteps:
    """How far back the parts of the monitor's score look (``score`` of a case in params.yaml)."""

    innovation: InnovationSteps
    consistency: InnovationSteps
    scatter: int
    scatter_share: float
    noise: NoiseSteps
    shift: ShiftSteps | None
    release: Release


@dataclass(frozen=True)
class Scatter:
    """How much innovations scatter over many samples, where a little more than usual adds up.

    Sizes of the ``twin``'s innovations and of the ``closed_form``'s, which have weight ``share`` in
    the monitor's mean. They count no more than what is rare: they remember for long, and must not
    keep up an alarm about what is over.
    """

    twin: InnovationSize
    closed_form: InnovationSize
    share: float

    @property
    def known_after_steps(self) -> int:
        """How many steps after its first forecast a run has its first value."""
        return max(self.twin.steps, self.closed_form.steps)

    def of(self, run: Run) -> tuple[FloatArray, FloatArray]:
        """Return (window,) of the twin and of the closed form, on their common log scale."""
        pairs = ((self.twin, run.innovations), (self.closed_form, run.closed_form))
        twin, closed = (
            np.minimum(size.scale.of(size.statistic(values)), SATURATED) for size, values in pairs
        )
        return twin, closed


@dataclass(frozen=True)
class MeanParts:
    """Scores of innovations, the twin's and its closed form's, of parity residuals, of scatter.

    The monitor's mean is the geometric one. Its parts err for different reasons: the Transformer
    where it has learnt too little or what it shouldn't, the closed form where things are not
    linear, both where a fault has been in their past for a while, and the ``relations`` within a
    sample, whose residuals ``consistency`` judges, wherever only time would tell. The last one's
    weight is the share of states whose relation holds (``share_holding``), where that of the first
    two is 1. ``scatter`` stands beside these three, or is left out.
    """

    twin: InnovationScore
    closed_form: InnovationScore
    consistency: InnovationScore
    relations: Consistency
    share_holding: float
    scatter: Scatter | None

    @classmethod
    def fit(cls, runs: Sequence[Run], relations: Consistency, steps: ScoreSteps) -> Self:
        """Fit on runs of held-out recordings; ``relations`` come from those for training."""
        rebuilt = [run.reconstruction for run in runs]
        residuals = [relations.residuals(run.samples) for run in runs]
        twin, closed = [run.innovations for run in runs], [run.closed_form for run in runs]
        scatter = None
        if steps.scatter_share:
            of_twin, of_closed = (InnovationSize.fit(v, steps.scatter) for v in (twin, closed))
            scatter = Scatter(of_twin, of_closed, steps.scatter_share)
        return cls(
            InnovationScore.fit(twin, rebuilt, steps.innovation),
            InnovationScore.fit(closed, None, steps.innovation),
            InnovationScore.fit(residuals, None, steps.consistency),
            relations,
            relations.share_holding(np.concatenate([run.samples for run in runs])),
            scatter,
        )

    @property
    def known_after_steps(self) -> int:
        """How many steps after its first forecast a run has its first score."""
        counted = [self.twin.known_after_steps, self.closed_form.known_after_steps]
        if self.share_holding:
            counted.append(self.consistency.known_after_steps)
        if self.scatter is not None:
            counted.append(self.scatter.known_after_steps)
        return max(counted)

    def of(self, run: Run) -> dict[str, FloatArray]:
        """Return (window,) scores along one gapless run by the detector that they belong to."""
        twin = self.twin.score(run.innovations, run.reconstruction)
        closed = self.closed_form.score(run.closed_form, run.reconstruction)
        tied = self.consistency.score(self.relations.residuals(run.samples), run.reconstruction)
        made = {
            ODISAR: _geometric_mean((twin, 1.0), (closed, 1.0), (tied, self.share_holding)),
            WITHOUT_TRANSFORMER: _geometric_mean((closed, 1.0), (tied, self.share_holding)),
            CLOSED_FORM: closed,
        }
        if self.scatter is not None:
            of_twin, of_closed = map(np.exp, self.scatter.of(run))
            scattered = {
                ODISAR: _geometric_mean((of_twin, 1.0), (of_closed, 1.0)),
                WITHOUT_TRANSFORMER: of_closed,
                CLOSED_FORM: of_closed,
            }
            share = self.scatter.share
            for name, scatter in scattered.items():
                made[name] = _geometric_mean((made[name], 1 - share), (scatter, share))
        return made | {CONSISTENCY: tied}


@dataclass(frozen=True)
class InnovationScores:
    """The monitor's score: the rarest of the mean of its parts, one sensor's noise, and its shift.

    A mean would dilute one noisy sensor, which the other parts hardly see, and one that reads
    wrong, which they soon forget; so ``noise`` and ``shift``, where it is sought, stand beside it.
    ``scales`` put means, by detector, on the same log scale: 1 is what is usual on held-out
    recordings, e what is rare. ``release`` lets them go when something strong is over.
    """

    parts: MeanParts
    noise: SensorNoise
    shift: StateShift | None
    scales: Mapping[str, LogScale]
    release: Release

    @property
    def known_after_steps(self) -> int:
        """How many steps after its first forecast a run has its first score."""
        return max(self.parts.known_after_steps, self.noise.known_after_steps)

    @classmethod
    def fit(cls, runs: Sequence[Run], relations: Consistency, steps: ScoreSteps) -> Self:
        """Fit on runs of held-out recordings; ``relations`` come from those for training."""
        parts = MeanParts.fit(runs, relations, steps)
        outliers = [run.outliers(parts.closed_form.size.precision) for run in runs]
        means = [parts.of(run) for run in runs]
        scales = {
            name: LogScale.fit(np.concatenate([mean[name] for mean in means])) for name in RELEASED
        }
        noise = SensorNoise.fit(outliers, steps.noise)
        return cls(parts, noise, _fit_shift(runs, parts, steps.shift), scales, steps.release)

    def of(self, run: Run) -> dict[str, NDArray[np.float32]]:
        """Return (window,) scores along one gapless run by detector."""
        made = self.parts.of(run)
        noise = self.noise.score(run.outliers(self.parts.closed_form.size.precision))
        shifts = self.shifts(run)
        for name in RELEASED:
            logs = self.scales[name].of(made[name])
            if name != CLOSED_FORM:
                logs = np.maximum(logs, noise)
            if name in shifts:
                logs = np.maximum(logs, np.nan_to_num(shifts[name], nan=-np.inf))
            made[name] = np.exp(self.release.of(logs))
        return {
            name: np.clip(part, _SMALLEST, _LARGEST).astype(np.float32)
            for name, part in made.items()
        }

    def shifts(self, run: Run) -> dict[str, FloatArray]:
        """Return (window,) scores of a shift by detector, on the log scale, where one is sought."""
        if self.shift is None:
            return {}
        parts, tied = self.parts, None
        if parts.share_holding:
            tied = parts.consistency.parts(parts.relations.residuals(run.samples)).max(axis=0)
        of_twin, of_closed = _shift_ratios(run, parts, self.shift.steps.memory)
        return {
            ODISAR: self.shift.score(of_twin, of_closed, tied),
            WITHOUT_TRANSFORMER: self.shift.score(None, of_closed, tied),
        }


def _fit_shift(
    runs: Sequence[Run], parts: MeanParts, steps: ShiftSteps | None
) -> StateShift | None:
    if steps is None:
        return None
    ratios = [_shift_ratios(run, parts, steps.memory) for run in runs]
    return StateShift.fit([twin for twin, _ in ratios], [closed for _, closed in ratios], steps)


def _shift_ratios(run: Run, parts: MeanParts, memory: int) -> tuple[FloatArray, FloatArray]:
    """Return (window,) ratios of the twin's innovations and of the closed form's."""
    twin = run.shifts(run.innovations, parts.twin.size.precision, memory)
    return twin, run.shifts(run.closed_form, parts.closed_form.size.precision, memory)


def _geometric_mean(*weighed: tuple[FloatArray, float]) -> FloatArray:
    counted = [(scores, weight) for scores, weight in weighed if weight > 0]
    logs = sum(weight * np.log(scores) for scores, weight in counted)
    return np.asarray(np.exp(logs / sum(weight for _, weight in counted)))
