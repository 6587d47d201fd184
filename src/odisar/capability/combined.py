"""The monitor's score: what innovations, parity residuals and noise of one sensor say together."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from odisar.capability.consistency import Consistency
from odisar.capability.innovations import FloatArray, InnovationScore, InnovationSteps, LogScale
from odisar.capability.outliers import NoiseSteps, SensorNoise

#: The monitor's score, and the same without its Transformer.
ODISAR, WITHOUT_TRANSFORMER = "odisar", "without-transformer"
#: What these are made of: innovations of the closed form, parity residuals.
CLOSED_FORM, CONSISTENCY = "closed-form", "consistency"


@dataclass(frozen=True)
class Run:
    """What is known along one gapless run.

    ``innovations`` of the twin and ``closed_form`` are (window, state feature), ``samples``
    (window, feature), ``reconstruction`` errors (window,). ``outliers`` returns (window, state)
    squares of the outlier filter, given the precision of the closed form's innovations.
    """

    innovations: FloatArray
    closed_form: FloatArray
    samples: NDArray[np.float32]
    reconstruction: FloatArray
    outliers: Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class ScoreSteps:
    """How far back the parts of the monitor's score look (``score`` of a case in params.yaml)."""

    innovation: InnovationSteps
    consistency: InnovationSteps
    noise: NoiseSteps


@dataclass(frozen=True)
class MeanParts:
    """Scores of innovations, the twin's and its closed form's, and of parity residuals.

    The monitor's mean is the geometric one of the three. They err for different reasons: the
    Transformer where it has learnt too little or what it shouldn't, the closed form where things
    are not linear, both where a fault has been in their past for a while, and the ``relations``
    within a sample, whose residuals ``consistency`` judges, wherever only time would tell. The last
    one's weight is the share of states whose relation holds (``share_holding``).
    """

    twin: InnovationScore
    closed_form: InnovationScore
    consistency: InnovationScore
    relations: Consistency
    share_holding: float

    @classmethod
    def fit(cls, runs: Sequence[Run], relations: Consistency, steps: ScoreSteps) -> Self:
        """Fit on runs of held-out recordings; ``relations`` come from those for training."""
        rebuilt = [run.reconstruction for run in runs]
        residuals = [relations.residuals(run.samples) for run in runs]
        return cls(
            InnovationScore.fit([run.innovations for run in runs], rebuilt, steps.innovation),
            InnovationScore.fit([run.closed_form for run in runs], None, steps.innovation),
            InnovationScore.fit(residuals, None, steps.consistency),
            relations,
            relations.share_holding(np.concatenate([run.samples for run in runs])),
        )

    @property
    def known_after_steps(self) -> int:
        """How many steps after its first forecast a run has its first score."""
        tied = [self.consistency] if self.share_holding else []
        return max(part.known_after_steps for part in (self.twin, self.closed_form, *tied))

    def of(self, run: Run) -> dict[str, FloatArray]:
        """Return (window,) scores along one gapless run by the detector that they belong to."""
        twin = self.twin.score(run.innovations, run.reconstruction)
        closed = self.closed_form.score(run.closed_form, run.reconstruction)
        tied = self.consistency.score(self.relations.residuals(run.samples), run.reconstruction)
        return {
            ODISAR: _geometric_mean((twin, 1.0), (closed, 1.0), (tied, self.share_holding)),
            WITHOUT_TRANSFORMER: _geometric_mean((closed, 1.0), (tied, self.share_holding)),
            CLOSED_FORM: closed,
            CONSISTENCY: tied,
        }


@dataclass(frozen=True)
class InnovationScores:
    """The monitor's score: the mean of its parts, or the noise of one sensor, whichever is rarer.

    A mean would dilute one noisy sensor, which the other parts hardly see; so ``noise`` stands
    beside it. ``scale`` and ``scale_without`` (the Transformer) put the mean on noise's log scale:
    1 is what is usual on held-out recordings, e what is rare.
    """

    parts: MeanParts
    noise: SensorNoise
    scale: LogScale
    scale_without: LogScale

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
        scale, without = (
            LogScale.fit(np.concatenate([mean[name] for mean in means]))
            for name in (ODISAR, WITHOUT_TRANSFORMER)
        )
        return cls(parts, SensorNoise.fit(outliers, steps.noise), scale, without)

    def of(self, run: Run) -> dict[str, NDArray[np.float32]]:
        """Return (window,) scores along one gapless run by detector."""
        made = self.parts.of(run)
        noise = self.noise.score(run.outliers(self.parts.closed_form.size.precision))
        for name, scale in ((ODISAR, self.scale), (WITHOUT_TRANSFORMER, self.scale_without)):
            made[name] = np.exp(np.maximum(scale.of(made[name]), noise))
        return {name: scores.astype(np.float32) for name, scores in made.items()}


def _geometric_mean(*weighed: tuple[FloatArray, float]) -> FloatArray:
    counted = [(scores, weight) for scores, weight in weighed if weight > 0]
    logs = sum(weight * np.log(scores) for scores, weight in counted)
    return np.asarray(np.exp(logs / sum(weight for _, weight in counted)))
