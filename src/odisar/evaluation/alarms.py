"""Alarms: flags that lasted, the threshold that holds a promised rate, and what events cost."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from odisar.errors import OdisarError
from odisar.evaluation.labels import merge_events
from odisar.evaluation.scored import ScoredRecording

_SECONDS_PER_HOUR = 3600.0


def persistence_samples(persistence_s: float, spacing_s: float) -> int:
    """Return how many scores in a row must be high; each stands for one spacing, at least one."""
    return max(1, int(np.ceil(persistence_s / spacing_s - 1e-9)))


def _rolling_minimum(scores: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Return (time,) the lowest of the last ``width`` scores; -inf where one is missing."""
    known = np.where(np.isfinite(scores), scores, -np.inf)
    padded = np.concatenate([np.full(width - 1, -np.inf), known])
    lowest: NDArray[np.float64] = np.lib.stride_tricks.sliding_window_view(padded, width).min(
        axis=-1
    )
    return lowest


def find_alarms(scores: NDArray[np.float64], threshold: float, width: int) -> NDArray[np.intp]:
    """Return the indices at which an alarm is raised in one gapless run of (time,) scores.

    An alarm is raised when the score has exceeded the threshold ``width`` times in a row, and
    again only after it has fallen to the threshold or below. A NaN ends a row.
    """
    lasting = _rolling_minimum(scores, width) > threshold
    return np.flatnonzero(lasting & ~np.concatenate([[False], lasting[:-1]]))


def calibrate_operating_threshold(
    runs: Sequence[tuple[NDArray[np.float64], float]], rate_per_hour: float, persistence_s: float
) -> float:
    """Return the smallest threshold at and above which alarms keep to a rate.

    Parameters
    ----------
    runs
        Gapless runs of undisturbed recordings: (time,) scores and their spacing in seconds.
    rate_per_hour
        Most alarms allowed in an hour of scored time.
    persistence_s
        How long the score must exceed the threshold.

    Notes
    -----
    With m the lowest of the last scores, the alarms at threshold T are the steps of m from at most
    T to above T. So every rise of m counts for the thresholds it crosses, and the number of alarms
    at every threshold is a sum over rises: exact, without a search. The number isn't monotone (a
    threshold so low that the alarm never ends has a single alarm), hence "at and above".

    Raises
    ------
    OdisarError
        If there is no score to calibrate on.
    """
    rises: list[NDArray[np.float64]] = []
    hours = 0.0
    for scores, spacing_s in runs:
        lowest = _rolling_minimum(scores, persistence_samples(persistence_s, spacing_s))
        before = np.concatenate([[-np.inf], lowest[:-1]])
        rises.append(np.stack([before, lowest])[:, lowest > before])
        hours += np.isfinite(scores).sum() * spacing_s / _SECONDS_PER_HOUR
    bottoms, tops = np.concatenate(rises, axis=1) if rises else np.zeros((2, 0))
    if not len(tops):
        raise OdisarError(
            f"no calibration score lasts for persistence_s={persistence_s}: an operating threshold "
            "needs undisturbed calibration recordings longer than that"
        )
    candidates = np.unique(np.concatenate([bottoms[np.isfinite(bottoms)], tops]))
    begun = np.searchsorted(np.sort(bottoms), candidates, side="right")
    over = np.searchsorted(np.sort(tops), candidates, side="right")
    # The highest candidate has no alarm, so there is one after the last that has too many.
    too_many = np.flatnonzero(begun - over > rate_per_hour * hours)
    return float(candidates[too_many[-1] + 1 if len(too_many) else 0])


@dataclass(frozen=True)
class AlarmCount:
    """Alarms raised in scored time, in which none was due."""

    alarms: int
    hours: float
    windows: int

    def __add__(self, other: "AlarmCount") -> "AlarmCount":
        return AlarmCount(
            self.alarms + other.alarms, self.hours + other.hours, self.windows + other.windows
        )

    @property
    def per_hour(self) -> float:
        """Alarms per scored hour; NaN without any."""
        return self.alarms / self.hours if self.hours > 0 else float("nan")

    def interval(self, confidence: float) -> tuple[float, float]:
        """Return the exact Poisson interval of the rate per hour (Garwood, Biometrika 1936)."""
        low, high = poisson_interval(self.alarms, confidence)
        if self.hours <= 0:
            return float("nan"), float("nan")
        return low / self.hours, high / self.hours


def poisson_interval(count: int, confidence: float) -> tuple[float, float]:
    """Return the exact interval of a Poisson mean of which ``count`` was seen once."""
    tail = (1 - confidence) / 2
    low = float(chi2.ppf(tail, 2 * count)) / 2 if count else 0.0
    return low, float(chi2.ppf(1 - tail, 2 * count + 2)) / 2


def alarm_times(
    scored: ScoredRecording, detector: str, persistence_s: float
) -> NDArray[np.float64]:
    """Return (alarm,) the seconds at which a detector's alarms are raised, on the shared support.

    The moment is that at which persistence is satisfied, not the first high score.
    """
    scores = np.where(scored.support(), scored.scores[detector], np.nan)
    width = persistence_samples(persistence_s, scored.spacing_s)
    threshold = scored.operating_thresholds[detector]
    times = [
        scored.time_s[start + find_alarms(scores[start:stop], threshold, width)]
        for start, stop in scored.runs()
    ]
    return np.concatenate(times) if times else np.zeros(0)


def count_alarms(scored: ScoredRecording, detector: str, persistence_s: float) -> AlarmCount:
    """Return a detector's alarms in an undisturbed recording, with the scored hours behind them."""
    windows = int(scored.support().sum())
    return AlarmCount(
        alarms=len(alarm_times(scored, detector, persistence_s)),
        hours=windows * scored.spacing_s / _SECONDS_PER_HOUR,
        windows=windows,
    )


@dataclass(frozen=True)
class EventOutcome:
    """What came of one event: ``delay_s`` is inf if undetected, ``lead_s`` NaN if undefined."""

    delay_s: float
    lead_s: float


def judge_events(
    scored: ScoredRecording, detector: str, persistence_s: float
) -> list[EventOutcome]:
    """Return the outcome of every event that has a scored time.

    An event is detected by an alarm raised in it; one that was standing before the onset is a
    false alarm and no detection. The first consequence belongs to the last event begun by then.
    """
    alarms = alarm_times(scored, detector, persistence_s)
    times = scored.time_s[scored.support()]
    events = merge_events(scored.intervals)
    consequence = scored.first_consequence_s
    begun = -1 if consequence is None else sum(e.onset_s <= consequence for e in events) - 1
    outcomes = []
    for number, event in enumerate(events):
        if not np.any((times >= event.onset_s) & (times < event.end_s)):
            continue
        inside = alarms[(alarms >= event.onset_s) & (alarms < event.end_s)]
        alarm_s = float(inside[0]) if len(inside) else float("inf")
        has_lead = consequence is not None and number == begun and len(inside) > 0
        lead_s = consequence - alarm_s if consequence is not None and has_lead else float("nan")
        outcomes.append(EventOutcome(delay_s=alarm_s - event.onset_s, lead_s=lead_s))
    return outcomes
