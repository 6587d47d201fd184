"""Range-aware detection: VUS-PR, which forgives an alarm that is a little early or late.

A label says disturbed or not at every sample, but an event's first and last seconds are a
convention. VUS-PR (Paparrizos, Boniol, Palpanas, Tsay, Elmore and Franklin, "Volume under the
surface", PVLDB 15(11), 2022) lets the label fall off over a buffer on both sides of each event,
weighs recall by the share of events that are met at all, and averages the area under the
precision-recall curve over all buffers from none to the widest. Random scores reach about the share
of disturbed samples; with no buffer and one event it is the average precision.

The computation is that of tsadmetrics, which follows the later code of the measure's authors:
thresholds at 250 quantiles of the scores, and in recall's denominator only those buffer samples
that are flagged, so that a detector that knows the label reaches 1. That package is under the GPL,
is no part of this one, and is installed with the study's other packages only.
"""

from collections.abc import Mapping, Sequence
from importlib import import_module

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.config.cases import Groups
from odisar.config.judging import Judging
from odisar.errors import OdisarError
from odisar.evaluation.cells import Cell, cell_resampler, describe, disturbed_cells
from odisar.evaluation.intervals import UNKNOWN, Interval, Resampler
from odisar.evaluation.labels import label_active
from odisar.evaluation.scored import ScoredRecording
from odisar.evaluation.tables import check_detectors

VUS_COLUMNS = (
    "setup",
    "evaluated_on",
    "strength",
    "detector",
    "vus_pr",
    "ci_low",
    "ci_high",
    "disturbed_share",
    "recordings",
    "buffer_s",
)


def vus_pr_table(
    scored: Mapping[str, Sequence[ScoredRecording]],
    case_groups: Groups,
    cfg: Judging,
    buffer_s: float,
    base_seed: int,
) -> pd.DataFrame:
    """Return VUS-PR of every detector in every cell of disturbed recordings.

    Parameters
    ----------
    scored
        By set-up, the scored recordings; their order has no influence.
    case_groups, cfg, base_seed
        As for the detection table; the same base seed takes the same draws.
    buffer_s
        The widest buffer in seconds; half of it lies on either side of an event. A recording's
        time to compute grows with the number of buffers up to it.

    Returns
    -------
    DataFrame with ``VUS_COLUMNS``. ``disturbed_share`` is what random scores would reach, but for
    the buffer; ``recordings`` are those behind the value.
    """
    rows = []
    for setup, given in scored.items():
        recordings = sorted(given, key=lambda item: item.name)
        check_detectors(setup, recordings)
        cells = disturbed_cells(
            [describe(item.info, case_groups) for item in recordings], case_groups
        )
        draws = [
            cell_resampler(cell, [recordings[i].cluster for i in cell.members], cfg, base_seed)
            for cell in cells
        ]
        shares = np.array([_disturbed_share(item) for item in recordings])
        for detector in recordings[0].detectors:
            values = _values(recordings, cells, detector, buffer_s)
            for cell, resampler in zip(cells, draws, strict=True):
                own = values[cell.members]
                value, interval = mean_over_recordings(own, resampler)
                known = ~np.isnan(own)
                share = float(shares[cell.members][known].mean()) if known.any() else float("nan")
                where = (setup, cell.evaluated_on, cell.strength_or_nan, detector)
                row = (*where, value, *interval, share, int(known.sum()), buffer_s)
                rows.append(dict(zip(VUS_COLUMNS, row, strict=True)))
    return pd.DataFrame(rows, columns=list(VUS_COLUMNS))


def _values(
    recordings: Sequence[ScoredRecording], cells: Sequence[Cell], detector: str, buffer_s: float
) -> NDArray[np.float64]:
    """Return (recording,) VUS-PR; NaN for recordings in no cell."""
    values = np.full(len(recordings), np.nan)
    for i in sorted({int(i) for cell in cells for i in cell.members}):
        steps = round(buffer_s / recordings[i].step_s)
        values[i] = recording_vus_pr(recordings[i], detector, steps)
    return values


def vus_pr(
    recordings: Sequence[ScoredRecording],
    detector: str,
    buffer_steps: int,
    resampler: Resampler,
) -> tuple[float, Interval]:
    """Return the mean VUS-PR over recordings, and its interval over their clusters.

    The mean of recordings, as is usual with this measure, not that of their pooled samples: each
    recording's thresholds are its own. Recordings without both kinds of samples have no value.
    ``resampler`` is that of these recordings, in this order; ``buffer_steps`` is the widest buffer.
    """
    values = [recording_vus_pr(item, detector, buffer_steps) for item in recordings]
    return mean_over_recordings(np.array(values), resampler)


def recording_vus_pr(scored: ScoredRecording, detector: str, buffer_steps: int) -> float:
    """Return VUS-PR of a detector on one recording; NaN unless it has both kinds of samples.

    Samples are those of protocol P2: each scored time that all detectors share, disturbed if a
    disturbance is active then. Gaps are closed up. Where not every step is scored, the buffer is
    as long in time.

    Raises
    ------
    OdisarError
        If the buffer is negative, or the package that computes the measure isn't installed.
    """
    if buffer_steps < 0:
        raise OdisarError(f"buffer_steps={buffer_steps} must not be negative")
    labels = _labels(scored)
    if labels.all() or not labels.any():
        return float("nan")
    scores = scored.scores[detector][scored.support()]
    return _volume(labels, scores, buffer_steps // scored.stride_steps)


def mean_over_recordings(
    values: NDArray[np.float64], resampler: Resampler
) -> tuple[float, Interval]:
    """Return the mean of (recording,) values that are no NaN, and its interval over clusters."""
    known = ~np.isnan(values)
    if not known.any():
        return float("nan"), UNKNOWN
    drawn = resampler.totals(np.stack([np.where(known, values, 0.0), known], axis=1))
    means = np.full(len(drawn), np.nan)
    np.divide(drawn[:, 0], drawn[:, 1], out=means, where=drawn[:, 1] > 0)
    return float(values[known].mean()), resampler.interval(means)


def _disturbed_share(scored: ScoredRecording) -> float:
    labels = _labels(scored)
    return float(labels.mean()) if len(labels) else float("nan")


def _labels(scored: ScoredRecording) -> NDArray[np.bool_]:
    return label_active(scored.time_s[scored.support()], scored.intervals)


def _volume(labels: NDArray[np.bool_], scores: NDArray[np.float64], buffer: int) -> float:
    """Return the volume for (sample,) labels of both kinds and scores; buffer in samples."""
    try:
        registry = import_module("tsadmetrics.metrics.Registry").Registry
    except ImportError:
        raise OdisarError(
            "VUS-PR is computed by the package tsadmetrics, which isn't installed; run `make "
            "study-setup` for the packages that only the study needs"
        ) from None
    return float(registry.get_metric("vus_pr", window=buffer).compute(labels.astype(int), scores))
