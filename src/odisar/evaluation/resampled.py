"""Detection metrics of a cell, with the bootstrap draws behind their intervals.

The draws are kept beside the value because a difference of two detectors needs them in pairs: the
interval of a difference is that of the draws' differences, not a difference of intervals.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.evaluation.intervals import Interval, Resampler, bin_counts, bin_edges, shift_interval
from odisar.evaluation.metrics import (
    auroc_of_counts,
    confusion_of_counts,
    count_confusion,
    count_levels,
    tnr_of_counts,
)
from odisar.evaluation.protocols import Samples


@dataclass(frozen=True)
class Contribution:
    """What one recording adds to every cell, for one protocol and detector.

    (sample,) scores and labels; (2, bin) counts by label; (4,) counts by label and flag.
    """

    scores: NDArray[np.float64]
    labels: NDArray[np.bool_]
    binned: NDArray[np.float64]
    confusion: NDArray[np.float64]


def contributions(
    samples: Mapping[int, Samples], detector: str, bins: int
) -> dict[int, Contribution]:
    """Return what each recording contributes to its cells; all share the bins' edges."""
    pooled = [item.scores[detector] for item in samples.values()]
    edges = bin_edges(np.concatenate(pooled) if pooled else np.zeros(0), bins)
    return {
        i: Contribution(
            scores=item.scores[detector],
            labels=item.labels,
            binned=bin_counts(item.scores[detector], item.labels, edges),
            confusion=count_confusion(item.scores[detector] > 1.0, item.labels),
        )
        for i, item in samples.items()
    }


@dataclass(frozen=True)
class Resampled:
    """A metric and its draws.

    ``value`` is exact. ``drawn`` is (draw,), NaN where a draw leaves the metric undefined; draws
    from binned scores lie ``offset`` below the exact ones.
    """

    value: float
    drawn: NDArray[np.float64]
    offset: float = 0.0

    def interval(self, resampler: Resampler) -> Interval:
        """Return the interval of a share, within 0 and 1."""
        return shift_interval(resampler.interval(self.drawn), self.offset)


def measure_detection(parts: Sequence[Contribution], resampler: Resampler) -> dict[str, Resampled]:
    """Return every detection metric by name for the recordings of one cell."""
    levels = count_levels(
        np.concatenate([part.scores for part in parts]),
        np.concatenate([part.labels for part in parts]),
    )
    binned = np.stack([part.binned for part in parts])
    confusions = np.stack([part.confusion for part in parts])
    undisturbed, disturbed = binned.sum(axis=0)
    drawn = resampler.totals(binned)

    measured: dict[str, Resampled] = {}
    for metric, of_counts in (("auroc", auroc_of_counts), ("tnr_at_tpr95", tnr_of_counts)):
        value = float(of_counts(*levels))
        offset = value - float(of_counts(disturbed, undisturbed))
        measured[metric] = Resampled(value, of_counts(drawn[:, 1], drawn[:, 0]), offset)

    whole = confusion_of_counts(confusions.sum(axis=0))
    resampled = confusion_of_counts(resampler.totals(confusions))
    measured["f1_ind"] = Resampled(float(whole.f1_ind()), resampled.f1_ind())
    measured["f1_ood"] = Resampled(float(whole.f1_ood()), resampled.f1_ood())
    return measured
