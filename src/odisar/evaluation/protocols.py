"""Protocols: from a scored recording to labelled samples, on one support for all detectors."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.config.judging import Judging
from odisar.evaluation.labels import keep_outside_guards, label_active, label_upcoming
from odisar.evaluation.scored import ORACLE, ORACLE_THRESHOLD, ScoredRecording

#: ``P1`` is the paper's, ``P2`` the monitor's, with and without guards; ``proactive`` looks ahead.
PROTOCOLS = ("P1", "P2", "P2-guarded", "proactive")

#: Detectors whose score compares a forecast with what came true, so that it is known only later.
FORECAST_ERROR = "rmse"
SHORT_LEAD_ERROR = "rmse-short-lead"


@dataclass(frozen=True)
class Samples:
    """Labelled samples of one recording under one protocol.

    ``labels`` is (sample,), True for disturbed. ``scores`` holds for every detector and for the
    oracle (sample,) multiples of the detector's threshold: recordings judged by different twins
    can then be pooled, and a sample is flagged where its score exceeds 1.
    """

    labels: NDArray[np.bool_]
    scores: Mapping[str, NDArray[np.float64]]

    def __len__(self) -> int:
        return len(self.labels)


def take_samples(scored: ScoredRecording, protocol: str, cfg: Judging) -> Samples:
    """Return the samples of a recording under one of ``PROTOCOLS``."""
    if protocol == "P1":
        return _window_samples(scored, cfg.short_lead_s)
    keep = scored.support()
    labels = label_active(scored.time_s, scored.intervals)
    oracle = labels
    if protocol == "P2-guarded":
        keep &= keep_outside_guards(
            scored.time_s, scored.intervals, cfg.guard_start_s, cfg.guard_end_s
        )
    elif protocol == "proactive":
        labels = label_upcoming(
            scored.time_s, scored.intervals, scored.horizon_steps, scored.step_s
        )
        keep &= _has_whole_horizon(scored)
    elif protocol != "P2":
        raise ValueError(f"unknown protocol {protocol!r}; known: {', '.join(PROTOCOLS)}")
    scores = {name: scored.scores[name][keep] for name in scored.detectors}
    return _normalised(scored, labels[keep], scores, oracle[keep])


def _normalised(
    scored: ScoredRecording,
    labels: NDArray[np.bool_],
    scores: Mapping[str, NDArray[np.float64]],
    oracle: NDArray[np.bool_],
) -> Samples:
    relative = {name: score / scored.thresholds[name] for name, score in scores.items()}
    relative[ORACLE] = oracle / ORACLE_THRESHOLD
    return Samples(labels=labels, scores=relative)


def _has_whole_horizon(scored: ScoredRecording) -> NDArray[np.bool_]:
    """Return (time,) True where the horizon ends within the same gapless run."""
    ahead = scored.horizon_steps // scored.stride_steps
    whole = np.zeros(len(scored.time_s), dtype=bool)
    for start, stop in scored.runs():
        whole[start : max(start, stop - ahead)] = True
    return whole


def issue_indices(scored: ScoredRecording) -> NDArray[np.intp]:
    """Return the indices into ``time_s`` at which the windows of protocol P1 are issued.

    Windows of context + horizon lie end to end in every gapless run, from its first scored time.
    """
    ahead = scored.horizon_steps // scored.stride_steps
    window = -(-(scored.context_steps + scored.horizon_steps) // scored.stride_steps)
    return np.concatenate(
        [np.arange(start, stop - ahead, window) for start, stop in scored.runs()]
        or [np.zeros(0, dtype=np.intp)]
    )


def _window_samples(scored: ScoredRecording, short_lead_s: float) -> Samples:
    """Return the samples of P1: a window's score stands for each of its horizon's steps.

    A forecast error over the horizon is the online error h steps later, so it is read there.
    """
    issued = issue_indices(scored)
    ahead = scored.horizon_steps // scored.stride_steps
    short = min(ahead, int(np.ceil(short_lead_s / scored.spacing_s - 1e-9)))
    delays = {FORECAST_ERROR: ahead, SHORT_LEAD_ERROR: short}
    scores = {name: scored.scores[name][issued + delays.get(name, 0)] for name in scored.detectors}
    keep = np.ones(len(issued), dtype=bool)
    for score in scores.values():
        keep &= np.isfinite(score)

    issued_s = scored.time_s[issued][keep]
    steps_s = scored.step_s * np.arange(1, scored.horizon_steps + 1)
    labels = label_active(issued_s[:, None] + steps_s, scored.intervals).ravel()
    repeats = scored.horizon_steps
    return _normalised(
        scored,
        labels,
        {name: np.repeat(score[keep], repeats) for name, score in scores.items()},
        np.repeat(label_active(issued_s, scored.intervals), repeats),
    )
