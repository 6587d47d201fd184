"""The operating point in rows: false alarms, events detected, delays and lead times."""

from collections.abc import Mapping, Sequence
from functools import reduce

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.config.cases import Groups
from odisar.config.judging import Judging
from odisar.evaluation.alarms import AlarmCount, EventOutcome, count_alarms, judge_events
from odisar.evaluation.cells import (
    OVERALL,
    Cell,
    cell_resampler,
    clean_cells,
    describe,
    disturbed_cells,
)
from odisar.evaluation.intervals import Interval, Resampler, weighted_quantile
from odisar.evaluation.scored import ScoredRecording

#: The protocol of the operating metrics: alarms use what is known at the time.
OPERATING_PROTOCOL = "P2"

OPERATING_COLUMNS = (
    "setup",
    "detector",
    "recordings",
    "windows",
    "hours",
    "false_alarms",
    "false_alarms_per_hour",
    "ci_low",
    "ci_high",
    "events",
    "events_detected",
)

Measured = dict[str, tuple[float, Interval]]

_NO_ALARMS = AlarmCount(alarms=0, hours=0.0, windows=0)


def operating_rows(
    recordings: Sequence[ScoredRecording],
    groups: Groups,
    cfg: Judging,
    persistence_s: float,
    base_seed: int,
) -> list[dict[str, object]]:
    """Return the operating metrics of one set-up as rows of the detection table."""
    descriptions = [describe(item.info, groups) for item in recordings]
    clean = clean_cells(descriptions, groups)
    disturbed = disturbed_cells(descriptions, groups)
    rows: list[dict[str, object]] = []
    for detector in recordings[0].detectors:
        counts = _counts(recordings, clean, detector, persistence_s)
        for cell in clean:
            total = reduce(AlarmCount.__add__, (counts[i] for i in cell.members))
            rate = (total.per_hour, total.interval(cfg.confidence))
            rows += _rows(cell, detector, {"false_alarms_per_hour": rate})
        outcomes = _outcomes(recordings, disturbed, detector, persistence_s)
        for cell in disturbed:
            clusters = [recordings[i].cluster for i in cell.members]
            resampler = cell_resampler(cell, clusters, cfg, base_seed)
            measured = _measure_events([outcomes[i] for i in cell.members], resampler)
            rows += _rows(cell, detector, measured)
    return rows


def _counts(
    recordings: Sequence[ScoredRecording],
    cells: Sequence[Cell],
    detector: str,
    persistence_s: float,
) -> Mapping[int, AlarmCount]:
    members = sorted({int(i) for cell in cells for i in cell.members})
    return {i: count_alarms(recordings[i], detector, persistence_s) for i in members}


def _outcomes(
    recordings: Sequence[ScoredRecording],
    cells: Sequence[Cell],
    detector: str,
    persistence_s: float,
) -> Mapping[int, list[EventOutcome]]:
    members = sorted({int(i) for cell in cells for i in cell.members})
    return {i: judge_events(recordings[i], detector, persistence_s) for i in members}


def _rows(cell: Cell, detector: str, measured: Measured) -> list[dict[str, object]]:
    return [
        {
            "evaluated_on": cell.evaluated_on,
            "strength": cell.strength_or_nan,
            "protocol": OPERATING_PROTOCOL,
            "detector": detector,
            "metric": metric,
            "value": value,
            "ci_low": interval[0],
            "ci_high": interval[1],
        }
        for metric, (value, interval) in measured.items()
    ]


def _measure_events(outcomes: Sequence[Sequence[EventOutcome]], resampler: Resampler) -> Measured:
    """Return value and interval of the event metrics; ``outcomes`` by recording of the cell."""
    owner = np.array([i for i, own in enumerate(outcomes) for _ in own], dtype=np.intp)
    delays = np.array([item.delay_s for own in outcomes for item in own])
    leads = np.array([item.lead_s for own in outcomes for item in own])
    events = resampler.for_rows(owner)
    led = np.flatnonzero(~np.isnan(leads))
    return {
        "events_detected": _share(np.isfinite(delays), events),
        "delay_p50_s": _quantile(delays, events, 0.5),
        "delay_p90_s": _quantile(delays, events, 0.9),
        "lead_time_p50_s": _quantile(leads[led], events.for_rows(led), 0.5),
    }


def _share(hits: NDArray[np.bool_], rows: Resampler) -> tuple[float, Interval]:
    if not len(hits):
        return float("nan"), (float("nan"), float("nan"))
    both = rows.totals(np.stack([hits, np.ones(len(hits))], axis=1).astype(np.float64))
    drawn = np.full(len(both), np.nan)
    np.divide(both[:, 0], both[:, 1], out=drawn, where=both[:, 1] > 0)
    return float(hits.mean()), rows.interval(drawn)


def _quantile(values: NDArray[np.float64], rows: Resampler, share: float) -> tuple[float, Interval]:
    """Return a quantile over events with its interval; where it is an undetected event, NaN."""
    value = float(weighted_quantile(values, np.ones((1, len(values))), share)[0])
    low, high = rows.interval(weighted_quantile(values, rows.row_weights(), share))
    return _known(value), (_known(low), _known(high))


def _known(value: float) -> float:
    return value if np.isfinite(value) else float("nan")


def operating_table(
    scored: Mapping[str, Sequence[ScoredRecording]],
    case_groups: Groups,
    cfg: Judging,
    persistence_s: float,
) -> pd.DataFrame:
    """Return, per set-up and detector, the hours and events behind the operating metrics.

    ``recordings``, ``windows`` (scored times) and ``hours`` are of undisturbed recordings, with
    the exact Poisson interval of the rate; ``events`` are those of the ``overall`` recordings, over
    all strengths.
    """
    rows = []
    for setup, given in scored.items():
        recordings = sorted(given, key=lambda item: item.name)
        descriptions = [describe(item.info, case_groups) for item in recordings]
        clean = [c for c in clean_cells(descriptions, case_groups) if c.evaluated_on == OVERALL]
        overall = [
            c for c in disturbed_cells(descriptions, case_groups) if c.evaluated_on == OVERALL
        ]
        for detector in recordings[0].detectors:
            counts = _counts(recordings, clean, detector, persistence_s)
            outcomes = _outcomes(recordings, overall, detector, persistence_s)
            judged = [event for own in outcomes.values() for event in own]
            total = reduce(AlarmCount.__add__, counts.values(), _NO_ALARMS)
            low, high = total.interval(cfg.confidence)
            values = (
                setup,
                detector,
                len(counts),
                total.windows,
                total.hours,
                total.alarms,
                total.per_hour,
                low,
                high,
                len(judged),
                sum(np.isfinite(event.delay_s) for event in judged),
            )
            rows.append(dict(zip(OPERATING_COLUMNS, values, strict=True)))
    return pd.DataFrame(rows, columns=list(OPERATING_COLUMNS))
