"""Innovation scores of a twin of the small system, fitted on recordings it has not seen."""

from odisar.capability.innovations import FloatArray, InnovationScore
from odisar.capability.scoring import InnovationScores, RecordingScores, Scorer
from odisar.twin.bundle import TrainedTwin
from small_system import make_recording

#: The first score is known so many steps after the first forecast.
MEAN_STEPS, SIZE_STEPS = 10, 5


def fit_small_scores(twin: TrainedTwin) -> InnovationScores:
    """Return scores fitted on undisturbed recordings."""
    scorer = Scorer(twin, 64, "cpu")
    scored = [
        scorer.score(make_recording(f"held-out-{i}"), short_lead_steps=5) for i in range(4)
    ]
    return InnovationScores(
        _fitted([runs_of(scores, scores.innovations) for scores in scored]),
        _fitted([runs_of(scores, scores.closed_form_innovations) for scores in scored]),
    )


def small_scorer(twin: TrainedTwin, batch: int = 64) -> Scorer:
    """Return a scorer with fitted innovation scores."""
    return Scorer(twin, batch, "cpu", fit_small_scores(twin))


def runs_of(scores: RecordingScores, innovations: FloatArray) -> list[FloatArray]:
    """Return the innovations of each gapless run from its first known one."""
    return [innovations[start + 1 : stop] for start, stop in scores.runs]


def _fitted(by_recording: list[list[FloatArray]]) -> InnovationScore:
    runs = [run for own in by_recording for run in own]
    return InnovationScore.fit(runs, mean_steps=MEAN_STEPS, size_steps=SIZE_STEPS)
