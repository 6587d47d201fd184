"""All deployable detectors of a case on one recording: the twin's scores and the range rules."""

import numpy as np
from numpy.typing import NDArray

from odisar.baselines.range_rule import range_rule_scores
from odisar.capability.scoring import RecordingScores
from odisar.config.cases import Case
from odisar.recordings.schema import Recording


def detector_scores(
    case: Case, recording: Recording, scores: RecordingScores
) -> dict[str, NDArray[np.float64]]:
    """Return (window,) scores by detector, at the positions of ``scores``."""
    by_detector = dict(scores.scores)
    for rule in case.range_rules:
        by_detector[rule.name] = range_rule_scores(rule, recording, case, scores.positions)
    return {name: values.astype(np.float64) for name, values in by_detector.items()}
