"""Assessments: scores against thresholds, as the JSON that a MAPLE-K loop acts on."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odisar.capability.attribution import top_states
from odisar.capability.combined import ODISAR, RARE
from odisar.capability.innovations import FloatArray
from odisar.capability.quadrants import quadrant
from odisar.capability.responses import blamed_names, state_directions
from odisar.capability.scoring import RECONSTRUCTION, RecordingScores, Scorer
from odisar.capability.signatures import Signatures
from odisar.errors import OdisarError
from odisar.recordings.schema import Recording


@dataclass(frozen=True)
class Thresholds:
    """What calibration recordings allow: for the score, the paper's score, and the variance."""

    score: float
    reconstruction: float
    variance: float


@dataclass(frozen=True)
class Assessment:
    """What the capability says of one forecast window (paper, Fig. JSON example).

    Steps count samples of the recording from 0, times are its own seconds; both name the forecast
    horizon, which begins one step after the assessment was made (``issued_s``). ``is_OOD`` is what
    ``score`` says, known when it was issued; the paper's own score, flag and attribution stand
    beside it. Attributions are empty unless their score is above its threshold.
    """

    recording: str
    sequence_index: int
    start_time_step: int
    end_time_step: int
    issued_s: float
    start_s: float
    end_s: float
    is_OOD: bool  # noqa: N815 (the paper's key)
    score: float
    score_exceeds_threshold: bool
    reconstruction_error: float
    uncertainty_variance: float
    recon_exceeds_threshold: bool
    uncertainty_exceeds_threshold: bool
    category: str
    state_attribution: Mapping[str, float]
    reconstruction_attribution: Mapping[str, float]


class Capability:
    """The digital twin capability of one twin: assesses windows against calibrated thresholds."""

    def __init__(
        self, scorer: Scorer, thresholds: Thresholds | None, *, attribution_top: int
    ) -> None:
        self._scorer = scorer
        self._thresholds = thresholds
        self._top = attribution_top

    def assess(
        self, recording: Recording, scores: RecordingScores, *, stride_steps: int, step_s: float
    ) -> list[Assessment]:
        """Return the assessment of every ``stride_steps``-th scored window of a recording.

        ``scores`` are the recording's own (``Scorer.score``), ``step_s`` the time between samples
        in seconds. Raises OdisarError where the capability has not been calibrated.
        """
        if self._thresholds is None or self._scorer.innovation_scores is None:
            raise OdisarError(
                "this capability is not calibrated and refuses to answer; run the calibrate stage"
            )
        windows = reported_windows(scores, stride_steps)
        positions = scores.positions[windows]
        variances = self._scorer.variances(recording, positions)
        blamed = np.zeros((len(windows), len(blamed_names(self._scorer.twin))))
        # Nobody is blamed for what isn't OOD.
        is_ood = scores.scores[ODISAR][windows] > self._thresholds.score
        blamed[is_ood] = blame_windows(self._scorer, recording, scores, windows[is_ood])
        made = zip(windows, variances, blamed, strict=True)
        return [
            self._assessment(
                self._thresholds,
                _Window(recording, scores, int(window), index, float(variance), states),
                step_s,
            )
            for index, (window, variance, states) in enumerate(made)
        ]

    def _assessment(self, limits: Thresholds, window: "_Window", step_s: float) -> Assessment:
        twin, scores, at = self._scorer.twin, window.scores, window.number
        position = int(scores.positions[at])
        issued_s = float(window.recording.time_s[position])
        score = float(scores.scores[ODISAR][at])
        error = float(scores.scores[RECONSTRUCTION][at])
        is_ood, is_uncertain = score > limits.score, window.variance > limits.variance
        blamed = top_states(window.blamed, blamed_names(twin), self._top)
        rebuilt = top_states(scores.state_errors[at], twin.output_names, self._top)
        return Assessment(
            recording=window.recording.name,
            sequence_index=window.index,
            start_time_step=position + 1,
            end_time_step=position + twin.spec.horizon_steps,
            issued_s=issued_s,
            start_s=issued_s + step_s,
            end_s=issued_s + twin.spec.horizon_steps * step_s,
            is_OOD=is_ood,
            score=score,
            score_exceeds_threshold=is_ood,
            reconstruction_error=error,
            uncertainty_variance=window.variance,
            recon_exceeds_threshold=error > limits.reconstruction,
            uncertainty_exceeds_threshold=is_uncertain,
            category=quadrant(is_ood=is_ood, is_uncertain=is_uncertain).value,
            state_attribution=blamed if is_ood else {},
            reconstruction_attribution=rebuilt if error > limits.reconstruction else {},
        )


@dataclass(frozen=True)
class _Window:
    """A window that is being assessed: its place among the scored and among the reported ones."""

    recording: Recording
    scores: RecordingScores
    number: int
    index: int
    variance: float
    blamed: FloatArray


def reported_windows(scores: RecordingScores, stride_steps: int) -> NDArray[np.int64]:
    """Return which scored windows are reported: every ``stride_steps``-th of each gapless run.

    The first is the first whose score is known: some forecasts must have met their samples.
    """
    known = np.isfinite(scores.scores[ODISAR])
    first = [
        start + np.flatnonzero(np.logical_or.accumulate(known[start:stop]))[::stride_steps]
        for start, stop in scores.runs
    ]
    return np.concatenate([np.empty(0, dtype=np.int64), *first])


def blame_windows(
    scorer: Scorer, recording: Recording, scores: RecordingScores, windows: NDArray[np.int64]
) -> FloatArray:
    """Return (window, state) how much each state explains of what is seen at these windows.

    States are those of ``blamed_names``, ``windows`` ascend; see ``Signatures.blame``. Of the
    twin's innovations alone, in which a shift, a drift and noise of every state are sought: what
    the other parts of the score look at is of the same states.
    """
    assert scorer.innovation_scores is not None  # noqa: S101 (who asks has checked)
    signatures = Signatures.of(scorer.twin, scorer.innovation_scores.parts.twin)
    parts = [np.empty((0, len(blamed_names(scorer.twin))))]
    for start, stop in scores.runs:
        own = windows[(windows >= start) & (windows < stop)]
        directions = state_directions(scorer.twin, recording, scores.positions[start:stop])
        innovations = scores.innovations[start:stop]
        samples, is_rare = scores.samples[start:stop], scores.scores[ODISAR][start:stop] >= RARE
        parts.append(signatures.blame(innovations, samples, own - start, directions, is_rare))
    return np.concatenate(parts)


@cache
def assessment_schema() -> dict[str, Any]:
    """Return the published JSON Schema of an assessment."""
    text = files("odisar.capability").joinpath("assessment.schema.json").read_text("utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema


def assessments_json(assessments: Sequence[Assessment]) -> str:
    """Return the assessments as JSON text, checked against the schema.

    Raises OdisarError where one does not fit it (a NaN score, say).
    """
    # Takes as long to import as everything else here; many need assessments, few write them.
    import jsonschema  # noqa: PLC0415

    rows = [asdict(assessment) for assessment in assessments]
    validator = jsonschema.Draft202012Validator(assessment_schema())
    for row in rows:
        for problem in validator.iter_errors(row):
            raise OdisarError(
                f"assessment {row['sequence_index']} of {row['recording']} does not fit the "
                f"schema: {problem.json_path}: {problem.message}"
            )
    try:
        return json.dumps(rows, indent=1, allow_nan=False) + "\n"
    except ValueError as error:
        raise OdisarError(f"an assessment holds a value that is no number: {error}") from error
