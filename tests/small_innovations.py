"""Innovation scores of a twin of the small system, fitted on recordings it has not seen."""

import numpy as np

from odisar.capability.combined import InnovationScores
from odisar.capability.consistency import Consistency
from odisar.capability.innovations import FloatArray, InnovationScore, InnovationSteps
from odisar.capability.scoring import RECONSTRUCTION, RecordingScores, Scorer
from odisar.twin.bundle import TrainedTwin
from small_system import make_recording

#: The first score is known so many steps after the first forecast.
STEPS = InnovationSteps(mean=10, size=5, recent=3, recent_share=0.3)
#: Of parity residuals.
TIED = InnovationSteps(mean=6, size=5, recent=1, recent_share=0.4)


def fit_small_scores(twin: TrainedTwin) -> InnovationScores:
    """Return scores fitted on undisturbed recordings."""
    scorer, states = Scorer(twin, 64, "cpu"), twin.network.state_features
    scored = [scorer.score(make_recording(f"held-out-{i}"), short_lead_steps=5) for i in range(4)]
    twin, closed, rebuilt = (
        [run for scores in scored for run in runs_of(scores, values_of(scores))]
        for values_of in (
            lambda scores: scores.innovations,
            lambda scores: scores.closed_form_innovations,
            lambda scores: scores.scores[RECONSTRUCTION].astype(np.float64),
        )
    )
    seen = [run for scores in scored for run in runs_of(scores, scores.samples)]
    relations = Consistency.fit(np.concatenate(seen), states)
    tied = [relations.residuals(run) for run in seen]
    return InnovationScores(
        InnovationScore.fit(twin, rebuilt, STEPS),
        InnovationScore.fit(closed, None, STEPS),
        InnovationScore.fit(tied, None, TIED),
        relations,
        1.0,
    )


def small_scorer(twin: TrainedTwin, batch: int = 64) -> Scorer:
    """Return a scorer with fitted innovation scores."""
    return Scorer(twin, batch, "cpu", fit_small_scores(twin))


def runs_of(scores: RecordingScores, values: FloatArray) -> list[FloatArray]:
    """Return (window, ...) values in gapless runs, from each one's first known innovation."""
    return [values[start + 1 : stop] for start, stop in scores.runs]
