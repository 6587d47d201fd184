"""Innovation scores of a twin of the small system, fitted on recordings it has not seen."""

from collections.abc import Iterable

import numpy as np

from odisar.capability.combined import InnovationScores, Run, ScoreSteps
from odisar.capability.consistency import Consistency
from odisar.capability.innovations import InnovationSteps
from odisar.capability.outliers import NoiseSteps
from odisar.capability.release import Release
from odisar.capability.scoring import Scorer
from odisar.capability.shifts import ShiftSteps
from odisar.recordings.schema import Recording
from odisar.twin.bundle import TrainedTwin
from small_system import make_recording

STEPS = ScoreSteps(
    innovation=InnovationSteps(mean=10, size=5, recent=3, recent_share=0.3),
    consistency=InnovationSteps(mean=6, size=5, recent=1, recent_share=0.4),
    scatter=9,
    scatter_share=0.2,
    noise=NoiseSteps(lasting=6, recent=2, recent_share=0.5, margin=0.2),
    shift=ShiftSteps(memory=12, margin=0.2),
    release=Release(steps=8, share=0.5),
)
#: The first score is known so many steps after the first forecast.
KNOWN_AFTER = 10


def runs_of(twin: TrainedTwin, recordings: Iterable[Recording]) -> list[Run]:
    """Return what is known along each gapless run of recordings."""
    scorer = Scorer(twin, 64, "cpu")
    return [
        run
        for item in recordings
        for run in scorer.runs(item, scorer.score(item, short_lead_steps=5))
    ]


def fit_scores(twin: TrainedTwin, recordings: Iterable[Recording]) -> InnovationScores:
    """Return scores fitted on undisturbed recordings, relations included."""
    runs = runs_of(twin, recordings)
    samples = np.concatenate([run.samples[1:] for run in runs])
    relations = Consistency.fit(samples, twin.network.state_features)
    return InnovationScores.fit(runs, relations, STEPS)


def fit_small_scores(twin: TrainedTwin) -> InnovationScores:
    """Return scores fitted on undisturbed recordings of the small system."""
    return fit_scores(twin, [make_recording(f"held-out-{i}") for i in range(4)])


def small_scorer(twin: TrainedTwin, batch: int = 64) -> Scorer:
    """Return a scorer with fitted innovation scores."""
    return Scorer(twin, batch, "cpu", fit_small_scores(twin))
