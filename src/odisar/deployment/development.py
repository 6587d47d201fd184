"""How well a twin tells disturbed from undisturbed on development recordings: never on test."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.capability.combined import ODISAR
from odisar.capability.scoring import Scorer
from odisar.config.cases import Case
from odisar.config.judging import EvaluationConfig
from odisar.evaluation.cells import OVERALL, describe, disturbed_cells
from odisar.evaluation.intervals import Resampler, bin_counts, bin_edges, shift_interval
from odisar.evaluation.labels import label_active
from odisar.evaluation.metrics import auroc_of_counts, count_levels
from odisar.recordings.schema import Recording
from odisar.seeding import generator


@dataclass(frozen=True)
class DevelopmentScore:
    """AUROC of the monitor's score under protocol P2, all strengths pooled.

    ``auroc`` is None where the development recordings hold no disturbed or no undisturbed sample,
    the interval (over recordings that vary together) also where there is only one cluster.
    ``measured_on`` is a hash of the recordings and of the positions that were scored (they depend
    on context, horizon and the windows of the score): two can be compared where it is the same.
    """

    auroc: float | None
    ci_low: float | None
    ci_high: float | None
    recordings: int
    windows: int
    measured_on: str


def judged_recordings(recordings: Sequence[Recording], case: Case) -> list[Recording]:
    """Return the recordings that the case's ``overall`` rows judge, in the order of their names."""
    ordered = sorted(recordings, key=lambda item: item.name)
    cells = disturbed_cells([describe(item.info, case.groups) for item in ordered], case.groups)
    chosen = {int(i) for cell in cells if cell.evaluated_on == OVERALL for i in cell.members}
    return [ordered[i] for i in sorted(chosen)]


def measure(
    scorer: Scorer,
    case: Case,
    recordings: Sequence[Recording],
    judging: EvaluationConfig,
    *,
    stride_steps: int,
    seed: int,
) -> DevelopmentScore:
    """Score every ``stride_steps``-th window of the judged development recordings.

    The windows are those of protocol P2: from one horizon after the first full context of each
    segment, where the forecast errors have a score as well.
    """
    judged = judged_recordings(recordings, case)
    positions = [_positions(scorer, item, stride_steps) for item in judged]
    parts = [
        _score(scorer, item, at, case.short_lead_steps)
        for item, at in zip(judged, positions, strict=True)
    ]
    scores = np.concatenate([np.empty(0), *(part[0] for part in parts)])
    labels = np.concatenate([np.empty(0, dtype=bool), *(part[1] for part in parts)])
    auroc = float(auroc_of_counts(*count_levels(scores, labels)))
    low, high = float("nan"), float("nan")
    if np.isfinite(auroc):
        edges = bin_edges(scores, judging.bootstrap_bins)
        binned = np.stack([bin_counts(*part, edges) for part in parts])
        resampler = Resampler.draw(
            [item.info.base_seed or item.name for item in judged],
            judging.bootstrap_draws,
            judging.confidence,
            generator(seed, "development"),
        )
        drawn = resampler.totals(binned)
        undisturbed, disturbed = binned.sum(axis=0)
        offset = auroc - float(auroc_of_counts(disturbed, undisturbed))
        interval = resampler.interval(auroc_of_counts(drawn[:, 1], drawn[:, 0]))
        low, high = shift_interval(interval, offset)
    return DevelopmentScore(
        auroc=_known(auroc),
        ci_low=_known(low),
        ci_high=_known(high),
        recordings=len(judged),
        windows=len(scores),
        measured_on=_hash(judged, positions, stride_steps),
    )


def _positions(scorer: Scorer, recording: Recording, stride_steps: int) -> NDArray[np.int64]:
    """Return (window,) every ``stride_steps``-th judged position."""
    spec = scorer.twin.spec
    ahead = spec.horizon_steps if spec.known_ahead else 0
    assert scorer.innovation_scores is not None  # noqa: S101 (who asks has calibrated)
    first = max(spec.horizon_steps, scorer.innovation_scores.known_after_steps)
    return np.concatenate(
        [
            spec.issue_positions(segment, 1, horizon_steps=ahead)[first::stride_steps]
            for segment in recording.segments
        ]
    )


def _score(
    scorer: Scorer, recording: Recording, positions: NDArray[np.int64], short_lead_steps: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return (window,) scores and labels at the positions."""
    scored = scorer.score(recording, short_lead_steps=short_lead_steps)
    chosen = np.isin(scored.positions, positions, assume_unique=True)
    labels = label_active(recording.time_s[positions], recording.intervals)
    return scored.scores[ODISAR][chosen].astype(np.float64), labels


def _hash(
    recordings: Sequence[Recording], positions: Sequence[NDArray[np.int64]], stride_steps: int
) -> str:
    digest = hashlib.sha256(f"stride {stride_steps}".encode())
    for item, scored in zip(recordings, positions, strict=True):
        digest.update(f"\0{item.name}\0{item.segments}\0{item.intervals}\0".encode())
        for values in (item.time_s, item.values):
            digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
        digest.update(np.ascontiguousarray(scored, dtype="<i8").tobytes())
    return digest.hexdigest()


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None
