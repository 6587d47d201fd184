"""Detectors against one of them, recording by recording, and training seeds against one another.

Two detectors judged on the same recordings share what makes a recording hard, so the interval of
their difference is narrower than their two intervals suggest, and says more than whether those
overlap. Both are evaluated on the same bootstrap draws over clusters of recordings and subtracted
draw by draw (the paired bootstrap; Efron and Tibshirani 1993, chapter 8).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from odisar.config.cases import Groups
from odisar.config.judging import Judging
from odisar.errors import OdisarError
from odisar.evaluation.alarms import judge_events
from odisar.evaluation.cells import Cell, cell_resampler, describe, disturbed_cells
from odisar.evaluation.intervals import Interval, Resampler, weighted_quantile
from odisar.evaluation.operating import OPERATING_PROTOCOL
from odisar.evaluation.protocols import PROTOCOLS, take_samples
from odisar.evaluation.resampled import Resampled, contributions, measure_detection
from odisar.evaluation.scored import ScoredRecording
from odisar.evaluation.tables import check_detectors

PAIRED_COLUMNS = (
    "setup",
    "evaluated_on",
    "strength",
    "protocol",
    "metric",
    "detector",
    "other",
    "difference",
    "ci_low",
    "ci_high",
    "is_next_best",
)

#: Metrics that are compared; of the delay alone, less is better.
COMPARED_METRICS = ("auroc", "tnr_at_tpr95", "f1_ood")
DELAY_METRIC = "delay_p50_s"

#: What makes a cell of a result table, in the order of the spread's rows.
CELL_COLUMNS = ("setup", "evaluated_on", "strength", "protocol", "detector", "metric")

SPREAD_COLUMNS = (*CELL_COLUMNS, "seeds", "undefined", "mean", "smallest", "largest")

Row = dict[str, object]
Judged = Mapping[str, Resampled]
CellDraws = Sequence[tuple[Cell, Resampler]]


@dataclass(frozen=True)
class Comparison:
    """Which detector is compared with all others, by which protocols, on which cells (or all)."""

    reference: str
    protocols: Sequence[str] = PROTOCOLS
    cells: Collection[str] | None = None


def paired_table(
    scored: Mapping[str, Sequence[ScoredRecording]],
    case_groups: Groups,
    cfg: Judging,
    persistence_s: float,
    base_seed: int,
    comparison: Comparison,
) -> pd.DataFrame:
    """Return what the reference detector has over every other one, with paired intervals.

    Parameters
    ----------
    scored
        By set-up, the scored recordings; their order has no influence.
    case_groups, cfg, persistence_s, base_seed
        As for the detection table; the same base seed takes the same draws.
    comparison
        Which detector the others are subtracted from, and where.

    Returns
    -------
    DataFrame with ``PAIRED_COLUMNS``: ``difference`` is that of ``detector`` (the reference) minus
    that of ``other``, a fraction or seconds. A difference of delays is empty where one of the two
    medians is an undetected event, its interval where a bound is, and every interval where there
    is but one cluster. ``is_next_best`` marks the other detector with the best value of the cell's
    metric, the first of equals, and none where no other has a value. The oracle isn't compared.

    Raises
    ------
    OdisarError
        If a set-up has no recordings, or they lack the reference or differ in their detectors.
    """
    rows: list[Row] = []
    for setup, given in scored.items():
        recordings = sorted(given, key=lambda item: item.name)
        check_detectors(setup, recordings)
        _check_reference(setup, recordings[0], comparison.reference)
        descriptions = [describe(item.info, case_groups) for item in recordings]
        draws = [
            (
                cell,
                cell_resampler(cell, [recordings[i].cluster for i in cell.members], cfg, base_seed),
            )
            for cell in disturbed_cells(descriptions, case_groups)
            if comparison.cells is None or cell.evaluated_on in comparison.cells
        ]
        found = _detection_rows(recordings, draws, cfg, comparison)
        found += _delay_rows(recordings, draws, persistence_s, comparison.reference)
        rows += [{"setup": setup, "detector": comparison.reference, **row} for row in found]
    return pd.DataFrame(rows, columns=list(PAIRED_COLUMNS))


def _check_reference(setup: str, first: ScoredRecording, reference: str) -> None:
    if reference not in first.detectors:
        raise OdisarError(
            f"set-up {setup!r}: no scores of {reference!r} to compare with; there are those of "
            f"{', '.join(first.detectors)}"
        )


def _detection_rows(
    recordings: Sequence[ScoredRecording], draws: CellDraws, cfg: Judging, comparison: Comparison
) -> list[Row]:
    rows: list[Row] = []
    reference = comparison.reference
    used = sorted({int(i) for cell, _ in draws for i in cell.members})
    for protocol in comparison.protocols:
        samples = {i: take_samples(recordings[i], protocol, cfg) for i in used}
        parts = {
            detector: contributions(samples, detector, cfg.bootstrap_bins)
            for detector in recordings[0].detectors
        }
        for cell, resampler in draws:
            measured = {
                detector: measure_detection([own[i] for i in cell.members], resampler)
                for detector, own in parts.items()
            }
            for metric in COMPARED_METRICS:
                judged = {detector: own[metric] for detector, own in measured.items()}
                better = {detector: own.value for detector, own in judged.items()}
                where = _where(cell, protocol, metric)
                for other, row in _others(judged, better, reference):
                    interval = _share_interval(judged[reference], judged[other], resampler)
                    rows.append({**where, **row, "ci_low": interval[0], "ci_high": interval[1]})
    return rows


def _delay_rows(
    recordings: Sequence[ScoredRecording], draws: CellDraws, persistence_s: float, reference: str
) -> list[Row]:
    rows: list[Row] = []
    delays = {
        detector: [
            [event.delay_s for event in judge_events(item, detector, persistence_s)]
            for item in recordings
        ]
        for detector in recordings[0].detectors
    }
    for cell, resampler in draws:
        judged = {
            detector: _median_delay([own[i] for i in cell.members], resampler)
            for detector, own in delays.items()
        }
        better = {detector: -own.value for detector, own in judged.items()}
        where = _where(cell, OPERATING_PROTOCOL, DELAY_METRIC)
        for other, row in _others(judged, better, reference):
            interval = _delay_interval(judged[reference], judged[other], resampler)
            rows.append({**where, **row, "ci_low": interval[0], "ci_high": interval[1]})
    return rows


def _where(cell: Cell, protocol: str, metric: str) -> Row:
    return {
        "evaluated_on": cell.evaluated_on,
        "strength": cell.strength_or_nan,
        "protocol": protocol,
        "metric": metric,
    }


def _others(judged: Judged, better: Mapping[str, float], reference: str) -> list[tuple[str, Row]]:
    """Return the other detectors with their part of a row; a higher ``better`` is better."""
    others = [detector for detector in judged if detector != reference]
    known = [detector for detector in others if np.isfinite(better[detector])]
    next_best = max(known, key=lambda detector: better[detector], default=None)
    return [
        (
            other,
            {
                "other": other,
                "difference": _finite(judged[reference].value - judged[other].value),
                "is_next_best": other == next_best,
            },
        )
        for other in others
    ]


def _share_interval(one: Resampled, other: Resampled, resampler: Resampler) -> Interval:
    """Return the interval of a difference of shares, within -1 and 1."""
    bounds = resampler.interval(one.drawn - other.drawn)
    offset = one.offset - other.offset
    low, high = (float(np.clip(bound + offset, -1.0, 1.0)) for bound in bounds)
    return low, high


def _delay_interval(one: Resampled, other: Resampled, resampler: Resampler) -> Interval:
    """Return the interval of a difference of delays; draws with both undetected have none."""
    with np.errstate(invalid="ignore"):
        low, high = resampler.interval(one.drawn - other.drawn)
    return _finite(low), _finite(high)


def _median_delay(delays: Sequence[Sequence[float]], resampler: Resampler) -> Resampled:
    """Return the median delay over a cell's events, inf where that is an undetected one."""
    owner = np.array([i for i, own in enumerate(delays) for _ in own], dtype=np.intp)
    values = np.array([delay for own in delays for delay in own], dtype=np.float64)
    weights = resampler.for_rows(owner).row_weights()
    value = float(weighted_quantile(values, np.ones((1, len(values))), 0.5)[0])
    return Resampled(value, weighted_quantile(values, weights, 0.5))


def _finite(value: float) -> float:
    return value if np.isfinite(value) else float("nan")


def seed_spread_table(tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Return how far the values of result tables lie apart from training seed to training seed.

    The interval of one training says what other recordings would change, not what another
    initialisation and order of batches would; this table says the latter.

    Parameters
    ----------
    tables
        Detection tables, one for each training seed, of the same recordings and detectors.

    Returns
    -------
    DataFrame with ``SPREAD_COLUMNS``, a row for each cell, detector and metric, in the order of
    the first table: ``seeds``, the tables with a value there, and the mean, smallest and largest
    of those values; ``undefined``, the tables without one (a delay that was never reached).

    Raises
    ------
    OdisarError
        If there are fewer than two tables, or one has other rows than the first.
    """
    if len(tables) < 2:
        raise OdisarError(
            f"{len(tables)} table cannot show a spread over training seeds; give at least two"
        )
    keys = list(CELL_COLUMNS)
    first = pd.MultiIndex.from_frame(tables[0][keys])
    for number, table in enumerate(tables[1:], start=2):
        other = pd.MultiIndex.from_frame(table[keys])
        if len(other) != len(first) or len(first.symmetric_difference(other)):
            raise OdisarError(
                f"table {number} of the training seeds has other rows than the first; evaluate "
                "every training on the same recordings with the same detectors"
            )
    stacked = pd.concat([table[[*keys, "value"]] for table in tables])
    values = stacked.groupby(keys, sort=False, dropna=False)["value"]
    spread = values.agg(
        seeds="count", undefined=_missing, mean="mean", smallest="min", largest="max"
    )
    return spread.reset_index()[list(SPREAD_COLUMNS)]


def _missing(values: pd.Series) -> int:
    return int(values.isna().sum())
