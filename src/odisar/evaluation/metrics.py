"""Detection metrics, exact with ties.

The ranking metrics work on counts of disturbed and undisturbed samples per score level, ascending
along the last axis. Distinct scores as levels give the exact value, bins an approximation for the
bootstrap; leading axes (draws) are carried along.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Counts = NDArray[np.float64]

#: Metrics that need only the order of the scores, and those that need the fixed threshold.
RANKING_METRICS = ("auroc", "tnr_at_tpr95")
THRESHOLD_METRICS = ("f1_ind", "f1_ood")


def count_levels(scores: NDArray[np.float64], labels: NDArray[np.bool_]) -> tuple[Counts, Counts]:
    """Return counts (level,) of disturbed and of undisturbed samples per distinct score."""
    levels, index = np.unique(scores, return_inverse=True)
    # Without a sample there is still one (empty) level, so that the rates are NaN and no error.
    size = max(1, len(levels))
    disturbed = np.bincount(index[labels], minlength=size).astype(np.float64)
    undisturbed = np.bincount(index[~labels], minlength=size).astype(np.float64)
    return disturbed, undisturbed


def auroc_of_counts(disturbed: Counts, undisturbed: Counts) -> NDArray[np.float64]:
    """Return (...) the area under the ROC curve; (..., level) counts in, NaN without both classes.

    It is the chance that a disturbed sample scores above an undisturbed one, ties counting half
    (Hanley and McNeil, Radiology 1982), which is the trapezoidal area.
    """
    above = disturbed.sum(axis=-1, keepdims=True) - np.cumsum(disturbed, axis=-1)
    wins = (undisturbed * (above + 0.5 * disturbed)).sum(axis=-1)
    return _ratio(wins, disturbed.sum(axis=-1) * undisturbed.sum(axis=-1))


def tnr_of_counts(disturbed: Counts, undisturbed: Counts) -> NDArray[np.float64]:
    """Return (...) the true negative rate where the true positive rate is nearest to 0.95.

    (..., level) counts in, NaN without both classes. The rule of the paper (section "Evaluation
    Metrics"), with two points it leaves open. Of two equally near rates the lower one counts: it
    has the lower false positive rate. Of samples with equal scores, disturbed and undisturbed ones
    are flagged in equal parts until the rate is reached, which is the chord of the ROC curve.
    Without ties this is the paper's rule to the letter; with them a threshold can only take all
    or none, and a detector with two score levels would be judged at a rate far from 0.95.
    """
    total = disturbed.sum(axis=-1, keepdims=True)
    # In whole numbers (0.95 = 19 / 20, halves down) so that rounding cannot decide between rates.
    wanted = (19 * total + 9) // 20
    hits = np.cumsum(disturbed[..., ::-1], axis=-1)
    false_alarms = np.cumsum(undisturbed[..., ::-1], axis=-1)
    level = np.argmax(hits >= wanted, axis=-1, keepdims=True)
    hits_in = np.take_along_axis(disturbed[..., ::-1], level, axis=-1)
    false_in = np.take_along_axis(undisturbed[..., ::-1], level, axis=-1)
    hits_at = np.take_along_axis(hits, level, axis=-1)
    false_at = np.take_along_axis(false_alarms, level, axis=-1)
    unused = _ratio(hits_at - wanted, hits_in)
    rate = _ratio(false_at - unused * false_in, undisturbed.sum(axis=-1, keepdims=True))
    return 1.0 - rate[..., 0]


def auroc(scores: NDArray[np.float64], labels: NDArray[np.bool_]) -> float:
    """Return the area under the ROC curve of (sample,) scores and labels; see the counts' form."""
    return float(auroc_of_counts(*count_levels(scores, labels)))


def tnr_at_tpr95(scores: NDArray[np.float64], labels: NDArray[np.bool_]) -> float:
    """Return the TNR at a TPR of 0.95 of (sample,) scores and labels; see the counts' form."""
    return float(tnr_of_counts(*count_levels(scores, labels)))


@dataclass(frozen=True)
class Confusion:
    """Samples by label and flag; each field has the same shape (of recordings, of draws)."""

    true_positive: Counts
    false_positive: Counts
    false_negative: Counts
    true_negative: Counts

    def f1_ood(self) -> NDArray[np.float64]:
        """Return the F1 of 'disturbed'; NaN where there is neither a label nor a flag of it."""
        twice = 2 * self.true_positive
        return _ratio(twice, twice + self.false_positive + self.false_negative)

    def f1_ind(self) -> NDArray[np.float64]:
        """Return the F1 of 'undisturbed'; NaN where there is neither a label nor a flag of it."""
        twice = 2 * self.true_negative
        return _ratio(twice, twice + self.false_positive + self.false_negative)


def count_confusion(flags: NDArray[np.bool_], labels: NDArray[np.bool_]) -> Counts:
    """Return (4,) true positives, false positives, false negatives and true negatives."""
    return np.array(
        [
            np.sum(flags & labels),
            np.sum(flags & ~labels),
            np.sum(~flags & labels),
            np.sum(~flags & ~labels),
        ],
        dtype=np.float64,
    )


def confusion_of_counts(counts: Counts) -> Confusion:
    """Return the confusion of (..., 4) counts, as ``count_confusion`` orders them."""
    return Confusion(*np.moveaxis(counts, -1, 0))


def _ratio(numerator: NDArray[np.float64], denominator: NDArray[np.float64]) -> NDArray[np.float64]:
    """Divide; NaN where the denominator is zero."""
    result = np.full(np.shape(denominator), np.nan)
    np.divide(numerator, denominator, out=result, where=denominator > 0)
    return result
