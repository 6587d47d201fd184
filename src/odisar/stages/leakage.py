"""Probe every detector of a member, or a user's own model, for leakage."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.baselines.interface import at_samples
from odisar.evaluation.leakage import probe_leakage
from odisar.evaluation.leakage_report import LeakageReport, leakage_table
from odisar.evaluation.own_model import Score
from odisar.recordings.schema import Recording
from odisar.seeding import derive_seed
from odisar.stages.detectors import MemberDetectors
from odisar.stages.members import MemberData
from odisar.windows.scaling import channel_std

#: Recordings that are probed, and how many horizons of each after its first whole context.
_RECORDINGS, _HORIZONS = 2, 3
#: Batches of another size round the last digits differently: a move is more than this share of
#: the score's interquartile range.
_TOLERATED_SHARE = 1.0e-4


def probed_recordings(data: MemberData) -> list[Recording]:
    """Return the beginnings of two calibration recordings, long enough for every score."""
    spec = data.spec
    samples = spec.unusable_steps + spec.context_steps + _HORIZONS * spec.horizon_steps + 20
    return [_beginning(item, samples) for item in data.splits["calibration"][:_RECORDINGS]]


def member_leakage(data: MemberData, detectors: MemberDetectors, seed: int) -> pd.DataFrame:
    """Return the findings of every detector of a member; see ``evaluation.leakage``."""
    recordings = probed_recordings(data)
    _, first = detectors.score(recordings[0])
    remembered = _Remembered(detectors)
    return leakage_table(
        [
            probe(data, name, remembered.score_of(name), recordings, seed, control_delay_steps=0)
            for name in first
        ]
    )


def probe(
    data: MemberData,
    name: str,
    score: Score,
    recordings: Sequence[Recording],
    seed: int,
    *,
    control_delay_steps: int,
) -> LeakageReport:
    """Return the report on one score of a case's recordings (see ``ProbePlan``)."""
    states = [i for i, c in enumerate(data.case.channels) if c.role == "state"]
    return probe_leakage(
        name,
        score,
        recordings,
        std=channel_std(data.splits["train"]),
        seed=derive_seed(seed, "leakage"),
        states=states,
        control_delay_steps=control_delay_steps,
        tolerated_share=_TOLERATED_SHARE,
    )


class _Remembered:
    """Calls of the first detector that is probed: all detectors share the twin's forecasts.

    The probes of every detector make the same calls in the same order. Only the same call at the
    same place is taken from memory, so that asking again does score again.
    """

    def __init__(self, detectors: MemberDetectors) -> None:
        self._detectors = detectors
        self._known: dict[tuple[int, bytes], list[dict[str, NDArray[np.float64]]]] = {}

    def score_of(self, name: str) -> Callable[[Sequence[Recording]], list[NDArray[np.float64]]]:
        """Return the scoring function of one detector."""
        calls = count()

        def score(recordings: Sequence[Recording]) -> list[NDArray[np.float64]]:
            key = next(calls), b"".join(_content(item) for item in recordings)
            if key not in self._known:
                self._known[key] = [self._scores(item) for item in recordings]
            return [scores[name] for scores in self._known[key]]

        return score

    def _scores(self, recording: Recording) -> dict[str, NDArray[np.float64]]:
        scores, by_detector = self._detectors.score(recording)
        return {
            name: at_samples(values, scores.positions, len(recording.time_s))
            for name, values in by_detector.items()
        }


def _content(recording: Recording) -> bytes:
    known = (recording.name, recording.segments, recording.intervals, recording.info)
    return recording.values.tobytes() + repr(known).encode()


def _beginning(recording: Recording, samples: int) -> Recording:
    segments = tuple(
        (start, min(stop, samples)) for start, stop in recording.segments if start < samples
    )
    return replace(
        recording,
        time_s=recording.time_s[:samples],
        values=recording.values[:samples],
        segments=segments,
    )
