"""Scored test recordings as they were judged, from what the evaluate stage left on disk."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from odisar.config.cases import Case
from odisar.evaluation.cells import OVERALL, clean_cells, metadata_columns
from odisar.evaluation.scored import ScoredRecording
from odisar.recordings.schema import Interval, RecordingInfo
from odisar.report.load import Results, rows_of
from odisar.report.names import strength_name
from odisar.report.ordering import ordered_values


@dataclass(frozen=True)
class Judged:
    """A set-up's test recordings: those disturbed by group, and the undisturbed ones.

    ``disturbed`` holds what counts overall, by the name of its strength or, without strengths, of
    its kind of disturbance.
    """

    disturbed: Mapping[str, Sequence[ScoredRecording]]
    undisturbed: Sequence[ScoredRecording]


def judged_recordings(results: Results, setup: str) -> Judged:
    """Return the recordings behind the overall rows of a set-up's result tables.

    A consequence of a disturbance isn't known here, so lead times can't be had from these.
    """
    known = results.examples.recordings
    known = known[known.setup == setup].reset_index(drop=True)
    case = results.case_of(setup)
    scores = dict(list(results.scores(setup).groupby("recording", sort=False)))
    limits = results.limits(setup)
    scored = [
        _scored_recording(row, scores[row.recording], limits[row.member], case)
        for row in rows_of(known)
    ]
    return Judged(
        {
            name: [scored[i] for i in part.index]
            for name, part in _groups(known[known.is_disturbed & known.is_overall])
        },
        [scored[i] for i in _undisturbed(known, case)],
    )


def has_events(results: Results, setup: str) -> bool:
    """Whether any recording that counts overall is disturbed."""
    known = results.examples.recordings
    return bool(((known.setup == setup) & known.is_overall & known.is_disturbed).any())


def has_false_alarm_hours(results: Results, setup: str) -> bool:
    """Whether there are events, and undisturbed recordings in which an alarm would be false."""
    known = results.examples.recordings
    quiet = (known.setup == setup) & ~known.is_disturbed
    return has_events(results, setup) and bool(quiet.any())


def judged_recording(results: Results, setup: str, recording: str) -> ScoredRecording:
    """Return one test recording of a set-up."""
    known = results.examples.recordings
    row: Any = next(rows_of(known[(known.setup == setup) & (known.recording == recording)]))
    scores = results.scores(setup)
    return _scored_recording(
        row,
        scores[scores.recording == recording],
        results.limits(setup)[row.member],
        results.case_of(setup),
    )


def keep_detector(scored: ScoredRecording, detector: str) -> ScoredRecording:
    """Return a recording with one detector's scores alone, still on what all detectors share."""
    values = np.where(scored.support(), scored.scores[detector], np.nan)
    return replace(scored, scores={detector: values})


def _scored_recording(
    row: Any, scores: pd.DataFrame, limits: Mapping[str, Any], case: Case
) -> ScoredRecording:
    detectors = [name for name in scores.columns if name not in ("recording", "time_s")]
    return ScoredRecording(
        name=row.recording,
        info=RecordingInfo(case=row.case, disturbance=row.disturbance),
        intervals=tuple(Interval(a, b, row.disturbance) for a, b in json.loads(row.events)),
        time_s=scores.time_s.to_numpy(dtype=np.float64),
        scores={name: scores[name].to_numpy(dtype=np.float64) for name in detectors},
        thresholds=limits["sigma"],
        operating_thresholds=limits["operating"],
        first_consequence_s=None,
        horizon_steps=case.window.horizon_steps,
        context_steps=case.window.context_steps,
        step_s=1 / case.rate_hz,
    )


def _groups(disturbed: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Return recordings by strength, weakest first; by kind where none has a strength."""
    if disturbed.strength.notna().any():
        return [
            (f"strength {strength_name(float(str(strength)))}", part)
            for strength, part in disturbed.groupby("strength", sort=True)
        ]
    kinds = ordered_values(disturbed, "disturbance")
    return [(kind, disturbed[disturbed.disturbance == kind]) for kind in kinds]


def _undisturbed(known: pd.DataFrame, case: Case) -> list[int]:
    """Return the places of the recordings whose alarms are false, as the tables count them."""
    columns = metadata_columns(case.groups)
    described = [
        {str(name): "" if pd.isna(value) else str(value) for name, value in row.items()}
        for row in known.reindex(columns=columns).to_dict("records")
    ]
    cells = clean_cells(described, case.groups)
    return [int(i) for cell in cells if cell.evaluated_on == OVERALL for i in cell.members]
