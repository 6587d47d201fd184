"""Assessments: scores against thresholds, as the JSON that a MAPLE-K loop acts on."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import jsonschema
import numpy as np
from numpy.typing import NDArray

from odisar.capability.attribution import top_states
from odisar.capability.quadrants import quadrant
from odisar.capability.scoring import ODISAR, RecordingScores, Scorer
from odisar.errors import OdisarError
from odisar.recordings.schema import Recording


@dataclass(frozen=True)
class Thresholds:
    """What calibration recordings allow: for the reconstruction error and for the variance."""

    reconstruction: float
    variance: float


@dataclass(frozen=True)
class Assessment:
    """What the capability says of one forecast window (paper, Fig. JSON example).

    Steps count samples of the recording from 0, times are its own seconds; both name the forecast
    horizon, which begins one step after the assessment was made (``issued_s``). Scores are in
    scaled units; ``state_attribution`` is empty unless the window is OOD.
    """

    recording: str
    sequence_index: int
    start_time_step: int
    end_time_step: int
    issued_s: float
    start_s: float
    end_s: float
    is_OOD: bool  # noqa: N815 (the paper's key)
    reconstruction_error: float
    uncertainty_variance: float
    recon_exceeds_threshold: bool
    uncertainty_exceeds_threshold: bool
    category: str
    state_attribution: Mapping[str, float]


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
        if self._thresholds is None:
            raise OdisarError(
                "this capability is not calibrated and refuses to answer; run the calibrate stage"
            )
        windows = reported_windows(recording, scores, stride_steps)
        positions = scores.positions[windows]
        variances = self._scorer.variances(recording, positions)
        return [
            self._assessment(recording, i, scores, window, float(variance), step_s)
            for i, (window, variance) in enumerate(zip(windows, variances, strict=True))
        ]

    def _assessment(
        self,
        recording: Recording,
        index: int,
        scores: RecordingScores,
        window: int,
        variance: float,
        step_s: float,
    ) -> Assessment:
        thresholds = self._thresholds
        assert thresholds is not None  # noqa: S101 (assess has checked)
        spec = self._scorer.twin.spec
        position = int(scores.positions[window])
        issued_s = float(recording.time_s[position])
        error = float(scores.scores[ODISAR][window])
        is_ood, is_uncertain = error > thresholds.reconstruction, variance > thresholds.variance
        blamed = top_states(scores.state_errors[window], self._scorer.twin.output_names, self._top)
        return Assessment(
            recording=recording.name,
            sequence_index=index,
            start_time_step=position + 1,
            end_time_step=position + spec.horizon_steps,
            issued_s=issued_s,
            start_s=issued_s + step_s,
            end_s=issued_s + spec.horizon_steps * step_s,
            is_OOD=is_ood,
            reconstruction_error=error,
            uncertainty_variance=variance,
            recon_exceeds_threshold=is_ood,
            uncertainty_exceeds_threshold=is_uncertain,
            category=quadrant(is_ood=is_ood, is_uncertain=is_uncertain).value,
            state_attribution=blamed if is_ood else {},
        )


def reported_windows(
    recording: Recording, scores: RecordingScores, stride_steps: int
) -> NDArray[np.int64]:
    """Return which scored windows are reported: every ``stride_steps``-th of each segment."""
    first = [
        np.flatnonzero((scores.positions >= start) & (scores.positions < stop))[::stride_steps]
        for start, stop in recording.segments
    ]
    return np.concatenate([np.empty(0, dtype=np.int64), *first])


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
