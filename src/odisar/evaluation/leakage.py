"""Leakage tests: whether a score uses what it couldn't have known, and uses what it is given.

Any scorer of recordings can be asked, one's own too (``evaluation.own_model``). Every probe of
``evaluation.leakage_probes`` changes what may not matter and compares scores with what they were;
the control changes what must matter, or a constant score would pass all the others.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from odisar.errors import OdisarError
from odisar.evaluation.leakage_probes import PROBES, Subject, copied
from odisar.evaluation.leakage_report import Finding, LeakageReport
from odisar.evaluation.own_model import Score, checked_scores
from odisar.recordings.schema import Recording
from odisar.seeding import generator
from odisar.windows.scaling import channel_std


@dataclass(frozen=True)
class ProbePlan:
    """How hard a scorer is probed.

    Attributes
    ----------
    states
        Positions of the channels that are states; the others are commands. None: all of them.
    positions_per_recording
        Samples t that are probed in each recording.
    control_delay_steps
        How many samples after x(t) changed the score may take to move.
    tolerated_share
        Share of the score's interquartile range up to which a change is no move. 0 asks for the
        same bits; 1e-5 lets pass what rounds differently with the size of a batch.
    """

    states: Sequence[int] | None = None
    positions_per_recording: int = 3
    control_delay_steps: int = 0
    tolerated_share: float = 0.0

    def __post_init__(self) -> None:
        if self.positions_per_recording < 1:
            raise OdisarError(
                f"positions_per_recording={self.positions_per_recording}: at least 1 sample of "
                "each recording must be probed"
            )
        if self.control_delay_steps < 0 or self.tolerated_share < 0:
            raise OdisarError(
                f"control_delay_steps={self.control_delay_steps} and "
                f"tolerated_share={self.tolerated_share:g} can't be below zero"
            )


class ProbeOptions(TypedDict, total=False):
    """What a call may say of a ``ProbePlan``; the plan has the meanings and the defaults."""

    states: Sequence[int] | None
    positions_per_recording: int
    control_delay_steps: int
    tolerated_share: float


def probe_leakage(
    name: str,
    score: Score,
    recordings: Sequence[Recording],
    *,
    std: NDArray[np.float64] | None,
    seed: int,
    **options: Unpack[ProbeOptions],
) -> LeakageReport:
    """Probe a scorer of recordings for leakage; the same seed probes the same samples.

    A command whose future is planned counts as unknown here: a detector that uses it moves under
    the probes ``future`` and ``truncation``.

    Parameters
    ----------
    name
        What the report calls the detector.
    score
        Takes recordings, returns for each an array (sample,) of scores, NaN where there is none.
    recordings
        At least one; every recording is scored a few dozen times, so few and short ones do.
    std
        (channel,) one sigma of every channel over the training recordings, in physical units;
        None takes it over ``recordings``.
    seed
        Seed of the samples and channels that are changed.
    **options
        The fields of ``ProbePlan``.

    Raises
    ------
    OdisarError
        If the recordings don't go together, a sigma or a channel doesn't fit them, or the scorer
        returns something else than scores or says nothing at all about a recording.
    """
    plan = ProbePlan(**options)
    _check_recordings(recordings)
    sigma = channel_std(recordings) if std is None else np.asarray(std, dtype=np.float64)
    states = _checked_states(plan.states, sigma, recordings[0].values.shape[1])
    alone = tuple(
        checked_scores(name, score([copied(recording)]), [recording])[0] for recording in recordings
    )
    iqr = _interquartile_range(alone)
    subject = Subject(
        name=name,
        score=score,
        recordings=tuple(recordings),
        alone=alone,
        positions=tuple(
            _probed_samples(name, recording, scores, plan, seed)
            for recording, scores in zip(recordings, alone, strict=True)
        ),
        std=sigma,
        states=states,
        seed=seed,
        control_delay_steps=plan.control_delay_steps,
        tolerated_change=plan.tolerated_share * iqr,
    )
    findings = tuple(Finding(probe, tuple(run(subject)), iqr) for probe, run in PROBES.items())
    return LeakageReport(name, findings, plan.control_delay_steps, plan.tolerated_share)


def _probed_samples(
    name: str, recording: Recording, scores: NDArray[np.float64], plan: ProbePlan, seed: int
) -> tuple[int, ...]:
    """Return scored samples, one drawn from each of so many equal parts of them.

    Each has a later sample in its segment, and as many as the control may wait.
    """
    after_steps = max(1, plan.control_delay_steps)
    inside = np.zeros(len(scores), dtype=bool)
    for start, stop in recording.segments:
        inside[start : max(start, stop - after_steps)] = True
    scored = np.flatnonzero(inside & np.isfinite(scores))
    if not scored.size:
        raise OdisarError(
            f"{name!r}, recording {recording.name!r}: none of its {len(scores)} samples has a "
            f"score and {after_steps} more in its segment, so nothing can be probed; give longer "
            "recordings"
        )
    random = generator(seed, "leakage", "samples", recording.name)
    parts = np.array_split(scored, min(plan.positions_per_recording, scored.size))
    return tuple(int(random.choice(part)) for part in parts)


def _check_recordings(recordings: Sequence[Recording]) -> None:
    if not recordings:
        raise OdisarError("no recording to probe a score on; give at least one")
    names = [recording.name for recording in recordings]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise OdisarError(f"recordings named {', '.join(repeated)} come twice; give each once")
    channels = {recording.values.shape[1] for recording in recordings}
    if len(channels) > 1:
        raise OdisarError(
            f"recordings with {sorted(channels)} channels are of different cases; probe a score "
            "on one case at a time"
        )


def _checked_states(
    states: Sequence[int] | None, sigma: NDArray[np.float64], channels: int
) -> tuple[int, ...]:
    if sigma.shape != (channels,) or not np.all(np.isfinite(sigma) & (sigma > 0)):
        raise OdisarError(
            f"std={sigma.tolist()} must be one finite number above zero for each of the "
            f"{channels} channels; channel_std of the training recordings is that"
        )
    chosen = tuple(range(channels) if states is None else states)
    if not chosen or min(chosen) < 0 or max(chosen) >= channels:
        raise OdisarError(
            f"states={list(chosen)} must be at least one position of the {channels} channels, "
            "counted from 0"
        )
    return chosen


def _interquartile_range(alone: Sequence[NDArray[np.float64]]) -> float:
    pooled = np.concatenate(alone)
    finite = pooled[np.isfinite(pooled)]
    return float(np.subtract(*np.quantile(finite, [0.75, 0.25]))) if finite.size else 0.0
