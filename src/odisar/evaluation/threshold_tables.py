"""Rules for a threshold beside one another: what each promised, and what it gave on test.

A ranking metric says how well a score can separate; which part of that an operator gets is up to
the threshold. For every rule the table holds the false alarms it was to keep to, those it raised,
and what it detected at that price.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.config.cases import Groups
from odisar.config.judging import Judging
from odisar.errors import OdisarError
from odisar.evaluation.alarms import AlarmCount, count_alarms, judge_events
from odisar.evaluation.cells import OVERALL, clean_cells, describe, disturbed_cells
from odisar.evaluation.intervals import weighted_quantile
from odisar.evaluation.labels import label_active
from odisar.evaluation.metrics import confusion_of_counts, count_confusion
from odisar.evaluation.scored import ScoredRecording
from odisar.evaluation.tables import check_detectors

THRESHOLD_COLUMNS = (
    "setup",
    "detector",
    "rule",
    "threshold",
    "promised_per_hour",
    "measured_per_hour",
    "ci_low",
    "ci_high",
    "hours",
    "recordings_alarmed",
    "strength",
    "f1_ood",
    "f1_ind",
    "events",
    "events_detected",
    "delay_p50_s",
)

#: By rule and detector: a threshold, or a promised rate of false alarms per hour.
ByRule = Mapping[str, Mapping[str, float]]

_NO_ALARMS = AlarmCount(alarms=0, hours=0.0, windows=0)


@dataclass(frozen=True)
class Ruled:
    """Recordings of one twin and the thresholds that each rule set for it.

    ``thresholds`` and ``promised_per_hour`` are by rule and detector. A rule that makes no promise,
    or sets no threshold for a detector, leaves it out. Twins of folds stand in one part each.
    """

    recordings: Sequence[ScoredRecording]
    thresholds: ByRule
    promised_per_hour: ByRule = field(default_factory=dict)


@dataclass(frozen=True)
class _Outcome:
    """What a rule gave on one recording: (4,) counts by label and flag, and (event,) delays."""

    confusion: NDArray[np.float64]
    delays_s: Sequence[float]
    alarms: AlarmCount


def threshold_table(
    parts: Mapping[str, Sequence[Ruled]],
    case_groups: Groups,
    cfg: Judging,
    persistence_s: float,
) -> pd.DataFrame:
    """Return what every rule promised and gave, by set-up, detector and strength.

    Parameters
    ----------
    parts
        By set-up, its recordings with the thresholds that hold for them: one part for one twin.
        The parts' rules and detectors are the same.
    case_groups
        Which recordings are judged together; the table holds the ``overall`` ones.
    cfg
        The confidence of the intervals.
    persistence_s
        How long a score must be high to raise an alarm.

    Returns
    -------
    DataFrame with ``THRESHOLD_COLUMNS``, a row for each strength, or one without strength where
    nothing is disturbed. ``threshold`` is empty where parts differ in it, ``promised_per_hour``
    where a rule promises nothing, and else the weakest promise of the parts. The false alarms per
    hour with their exact Poisson interval, the ``hours``, and the share ``recordings_alarmed`` of
    recordings with any alarm are those of undisturbed recordings; alarms that come in bursts keep
    a promise about blocks of time (conformal) and break the rate it stands for.
    Flags for F1 are single scores above the threshold; ``events_detected`` (a share of ``events``)
    and ``delay_p50_s`` (empty if that is an undetected event) are those of alarms that lasted.

    Raises
    ------
    OdisarError
        If a set-up has no recordings, its detectors differ, or a threshold isn't set in all parts
        or isn't a number.
    """
    rows: list[dict[str, object]] = []
    for setup, given in parts.items():
        recordings = [item for part in given for item in part.recordings]
        check_detectors(setup, sorted(recordings, key=lambda item: item.name))
        for rule, detector in _rules(setup, given, recordings[0].detectors):
            outcomes = [
                _judge(item, detector, part.thresholds[rule][detector], persistence_s)
                for part in given
                for item in part.recordings
            ]
            head = {
                "setup": setup,
                "detector": detector,
                "rule": rule,
                "threshold": _shared([part.thresholds[rule][detector] for part in given]),
                "promised_per_hour": _promise(given, rule, detector),
            }
            found = _rule_rows(recordings, outcomes, case_groups, cfg.confidence)
            rows += [{**head, **row} for row in found]
    return pd.DataFrame(rows, columns=list(THRESHOLD_COLUMNS))


def _rules(setup: str, parts: Sequence[Ruled], detectors: Sequence[str]) -> list[tuple[str, str]]:
    """Return every rule and detector of a set-up, by detector; each has a number in all parts."""
    first = parts[0].thresholds
    wanted = [(rule, d) for d in detectors for rule in first if d in first[rule]]
    for rule, detector in wanted:
        for part in parts:
            threshold = part.thresholds.get(rule, {}).get(detector, float("nan"))
            if not np.isfinite(threshold):
                raise OdisarError(
                    f"set-up {setup!r}: rule {rule!r} has no finite threshold for {detector!r} in "
                    "every part; calibrate all twins of the set-up by the same rules"
                )
    return wanted


def _judge(
    scored: ScoredRecording, detector: str, threshold: float, persistence_s: float
) -> _Outcome:
    ruled = replace(
        scored, operating_thresholds={**scored.operating_thresholds, detector: threshold}
    )
    keep = scored.support()
    labels = label_active(scored.time_s[keep], scored.intervals)
    events = judge_events(ruled, detector, persistence_s)
    return _Outcome(
        confusion=count_confusion(scored.scores[detector][keep] > threshold, labels),
        delays_s=[event.delay_s for event in events],
        alarms=count_alarms(ruled, detector, persistence_s),
    )


def _rule_rows(
    recordings: Sequence[ScoredRecording],
    outcomes: Sequence[_Outcome],
    groups: Groups,
    confidence: float,
) -> list[dict[str, object]]:
    """Return one row for each strength of the recordings that a rule was judged on."""
    descriptions = [describe(item.info, groups) for item in recordings]
    clean = [i for c in clean_cells(descriptions, groups)[:1] for i in c.members]
    quiet = reduce(AlarmCount.__add__, (outcomes[i].alarms for i in clean), _NO_ALARMS)
    alarmed = [outcomes[i].alarms.alarms > 0 for i in clean]
    low, high = quiet.interval(confidence)
    price: dict[str, object] = {
        "measured_per_hour": quiet.per_hour,
        "ci_low": low,
        "ci_high": high,
        "hours": quiet.hours,
        "recordings_alarmed": float(np.mean(alarmed)) if alarmed else float("nan"),
    }
    cells = [c for c in disturbed_cells(descriptions, groups) if c.evaluated_on == OVERALL]
    if not cells:
        return [price]
    return [
        {
            **price,
            "strength": cell.strength_or_nan,
            **_detection([outcomes[i] for i in cell.members]),
        }
        for cell in cells
    ]


def _detection(outcomes: Sequence[_Outcome]) -> dict[str, object]:
    confusion = confusion_of_counts(np.sum([own.confusion for own in outcomes], axis=0))
    delays = np.array([delay for own in outcomes for delay in own.delays_s], dtype=np.float64)
    median = float(weighted_quantile(delays, np.ones((1, len(delays))), 0.5)[0])
    return {
        "f1_ood": float(confusion.f1_ood()),
        "f1_ind": float(confusion.f1_ind()),
        "events": len(delays),
        "events_detected": float(np.isfinite(delays).mean()) if len(delays) else float("nan"),
        "delay_p50_s": median if np.isfinite(median) else float("nan"),
    }


def _shared(values: Sequence[float]) -> float:
    return values[0] if len(set(values)) == 1 else float("nan")


def _promise(parts: Sequence[Ruled], rule: str, detector: str) -> float:
    """Return the weakest promise of the parts; NaN where one of them has none."""
    rates = [part.promised_per_hour.get(rule, {}).get(detector, np.nan) for part in parts]
    return float(np.max(rates))
