"""Tables: every detector under every protocol on every group of recordings, with intervals."""

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise

import pandas as pd

from odisar.config.cases import Groups
from odisar.config.judging import Judging
from odisar.errors import OdisarError
from odisar.evaluation.cells import Cell, cell_resampler, describe, disturbed_cells
from odisar.evaluation.intervals import Resampler
from odisar.evaluation.operating import OPERATING_PROTOCOL, operating_rows, operating_table
from odisar.evaluation.protocols import PROTOCOLS, take_samples
from odisar.evaluation.published import (
    PUBLISHED_PROTOCOLS,
    is_full_strength,
    published_values,
)
from odisar.evaluation.resampled import contributions, measure_detection
from odisar.evaluation.scored import ORACLE, ScoredRecording
from odisar.evaluation.window_tables import attribution_table, quadrant_table

__all__ = [
    "DETECTION_COLUMNS",
    "attribution_table",
    "detection_table",
    "operating_table",
    "quadrant_table",
]

DETECTION_COLUMNS = (
    "setup",
    "evaluated_on",
    "strength",
    "protocol",
    "detector",
    "metric",
    "value",
    "ci_low",
    "ci_high",
    "published",
)

Row = dict[str, object]


def detection_table(
    scored: Mapping[str, Sequence[ScoredRecording]],
    case_groups: Groups,
    cfg: Judging,
    persistence_s: float,
    base_seed: int,
    published_as: Mapping[str, str | None],
    monitor_only: Collection[str] = (),
) -> pd.DataFrame:
    """Return the tidy table of detection and operating metrics of one case.

    Parameters
    ----------
    scored
        By set-up, the scored test recordings; their order has no influence.
    case_groups
        Which recordings are judged together.
    cfg
        Guards, confidence, and bootstrap draws and bins.
    persistence_s
        How long a score must be high to raise an alarm.
    base_seed
        The seed from which the bootstrap's are derived.
    published_as
        By set-up, the name under which the paper published it, or None.
    monitor_only
        Detectors that are judged by the monitor's protocol (P2) alone.

    Returns
    -------
    DataFrame with ``DETECTION_COLUMNS``. Shares are fractions, times seconds. ``strength`` is
    empty for recordings without one, the interval where it cannot be estimated (one cluster) or
    has no bound, ``published`` where the paper has no figure.
    """
    rows: list[Row] = []
    for setup, given in scored.items():
        recordings = sorted(given, key=lambda item: item.name)
        check_detectors(setup, recordings)
        descriptions = [describe(item.info, case_groups) for item in recordings]
        cells = disturbed_cells(descriptions, case_groups)
        resamplers = [
            cell_resampler(cell, [recordings[i].cluster for i in cell.members], cfg, base_seed)
            for cell in cells
        ]
        found = _detection_rows(recordings, cells, resamplers, cfg, monitor_only)
        found += operating_rows(recordings, case_groups, cfg, persistence_s, base_seed)
        rows += [{"setup": setup, **row} for row in found]
    table = pd.DataFrame(rows, columns=list(DETECTION_COLUMNS))
    table["published"] = [
        _published(row, published_as.get(str(row["setup"])))
        for row in table.to_dict(orient="records")
    ]
    return table


def check_detectors(setup: str, recordings: Sequence[ScoredRecording]) -> None:
    """Raise if recordings of a set-up differ in their detectors or share a name."""
    if not recordings:
        raise OdisarError(f"set-up {setup!r} has no scored recordings to evaluate")
    first = recordings[0]
    for before, item in pairwise(recordings):
        if item.name == before.name:
            raise OdisarError(f"set-up {setup!r}: recording {item.name!r} is scored twice")
        if set(item.detectors) != set(first.detectors):
            raise OdisarError(
                f"set-up {setup!r}: recording {item.name!r} has scores of "
                f"{sorted(item.detectors)}, {first.name!r} of {sorted(first.detectors)}; score "
                "all recordings with the same detectors"
            )


def _published(row: Mapping[object, object], setup: str | None) -> float:
    if (
        setup is None
        or row["protocol"] not in PUBLISHED_PROTOCOLS
        or not is_full_strength(float(str(row["strength"])))
    ):
        return float("nan")
    key = (setup, str(row["evaluated_on"]), str(row["detector"]), str(row["metric"]))
    return published_values().get(key, float("nan"))


def _detection_rows(
    recordings: Sequence[ScoredRecording],
    cells: Sequence[Cell],
    resamplers: Sequence[Resampler],
    cfg: Judging,
    monitor_only: Collection[str],
) -> list[Row]:
    """Return the rows of one set-up; what a recording contributes is computed once."""
    rows: list[Row] = []
    used = {int(i) for cell in cells for i in cell.members}
    for protocol in PROTOCOLS:
        samples = {i: take_samples(recordings[i], protocol, cfg) for i in sorted(used)}
        for detector in (*recordings[0].detectors, ORACLE):
            if protocol != OPERATING_PROTOCOL and detector in monitor_only:
                continue
            parts = contributions(samples, detector, cfg.bootstrap_bins)
            for cell, resampler in zip(cells, resamplers, strict=True):
                measured = measure_detection([parts[i] for i in cell.members], resampler)
                for metric, item in measured.items():
                    low, high = item.interval(resampler)
                    rows.append(
                        {
                            "evaluated_on": cell.evaluated_on,
                            "strength": cell.strength_or_nan,
                            "protocol": protocol,
                            "detector": detector,
                            "metric": metric,
                            "value": item.value,
                            "ci_low": low,
                            "ci_high": high,
                        }
                    )
    return rows
