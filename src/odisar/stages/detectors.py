"""All deployable detectors of a member: the twin's scores, cheap alternatives, range rules."""

from collections.abc import Mapping
from typing import Self

import numpy as np
from numpy.typing import NDArray

from odisar.baselines.interface import Detector, Reference
from odisar.baselines.range_rule import range_rule_scores
from odisar.baselines.registry import cheap_detectors, fit_existing
from odisar.capability.combined import InnovationScores, ScoreSteps
from odisar.capability.consistency import Consistency
from odisar.capability.innovations import InnovationSteps
from odisar.capability.outliers import NoiseSteps
from odisar.capability.release import Release
from odisar.capability.scoring import RecordingScores, Scorer
from odisar.capability.shifts import ShiftSteps
from odisar.config.score import ScoreConfig, StatisticsConfig
from odisar.recordings.schema import Recording
from odisar.seeding import derive_seed
from odisar.stages.members import MemberData
from odisar.twin.bundle import TrainedTwin
from odisar.windows.window_set import scaled_features

#: Detectors whose threshold is 1 by construction: range rules.
RULE_THRESHOLD = 1.0


class MemberDetectors:
    """Every detector of one member, ready to score recordings.

    The cheap alternatives are fitted anew by every stage that scores: that takes seconds, gives
    the same numbers, and nothing of theirs needs a file format.
    """

    def __init__(
        self, data: MemberData, scorer: Scorer, alternatives: Mapping[str, Detector]
    ) -> None:
        self._data = data
        self.scorer = scorer
        self._alternatives = alternatives

    @classmethod
    def fit(cls, data: MemberData, scorer: Scorer, seed: int) -> Self:
        """Fit the alternatives on the member's undisturbed recordings."""
        alternatives = fit_existing(cheap_detectors(data.case), member_reference(data, seed))
        return cls(data, scorer, alternatives)

    def score(self, recording: Recording) -> tuple[RecordingScores, dict[str, NDArray[np.float64]]]:
        """Return the twin's scores, and (window,) scores of every detector at their positions."""
        case = self._data.case
        scores = self.scorer.score(recording, short_lead_steps=case.short_lead_steps)
        by_detector = {name: part.astype(np.float64) for name, part in scores.scores.items()}
        for name, detector in self._alternatives.items():
            by_detector[name] = detector.score([recording])[0][scores.positions]
        for rule in case.range_rules:
            found = range_rule_scores(rule, recording, case, scores.positions)
            by_detector[rule.name] = found.astype(np.float64)
        return scores, by_detector


def member_reference(data: MemberData, seed: int) -> Reference:
    """Return what the alternatives of a member may learn from."""
    return Reference(
        case=data.case,
        spec=data.spec,
        scaler=data.scaler,
        train=data.splits["train"],
        held_out=data.splits["validation"],
        seed=derive_seed(seed, "alternatives"),
    )


def fit_innovation_scores(scorer: Scorer, data: MemberData) -> InnovationScores:
    """Fit what the monitor's score is made of.

    The relations within a sample on training recordings, all else on validation recordings: no
    weight was fitted to them.
    """
    lead = data.case.short_lead_steps
    runs = [
        run
        for item in data.splits["validation"]
        for run in scorer.runs(item, scorer.score(item, short_lead_steps=lead))
    ]
    steps = score_steps(data.case.score)
    return InnovationScores.fit(runs, fit_relations(data, scorer.twin), steps)


def fit_relations(data: MemberData, twin: TrainedTwin) -> Consistency:
    """Fit the relations that hold within a sample on the training recordings."""
    samples = scaled_features(data.splits["train"], twin.scaler, twin.spec)
    return Consistency.fit(samples.numpy(), twin.network.state_features)


def score_steps(config: ScoreConfig) -> ScoreSteps:
    """Return how far back a case's score looks."""
    noise, shift = config.noise, config.shift
    return ScoreSteps(
        innovation=_statistics(config.innovation),
        consistency=_statistics(config.consistency),
        scatter=config.scatter.steps,
        scatter_share=config.scatter.share,
        noise=NoiseSteps(noise.lasting_steps, noise.recent_steps, noise.recent_share, noise.margin),
        shift=None if shift is None else ShiftSteps(shift.memory_steps, shift.margin),
        release=Release(config.release.steps, config.release.share),
    )


def _statistics(config: StatisticsConfig) -> InnovationSteps:
    return InnovationSteps(
        config.mean_steps, config.size_steps, config.recent_steps, config.recent_share
    )
