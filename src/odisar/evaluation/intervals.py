"""Intervals: a bootstrap over clusters of recordings, by weights instead of copies.

Samples of one recording depend on one another, and so do recordings with the same base seed; both
would make a bootstrap over samples far too sure. Resampling clusters with multinomial weights
(Efron and Tibshirani 1993, chapter 8) needs only one sum per cluster, so a cell takes
milliseconds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Interval = tuple[float, float]
UNKNOWN: Interval = (float("nan"), float("nan"))


@dataclass(frozen=True)
class Resampler:
    """Bootstrap weights for the rows (recordings, events, windows) of one cell.

    ``weights`` is (draw, cluster), how often a draw takes a cluster; ``clusters`` is (row,), the
    cluster of every row.
    """

    weights: NDArray[np.float64]
    clusters: NDArray[np.intp]
    confidence: float

    @classmethod
    def draw(
        cls, clusters: Sequence[str], draws: int, confidence: float, rng: np.random.Generator
    ) -> "Resampler":
        """Draw weights for rows with these clusters; the order of the rows has no part in it."""
        names, codes = np.unique(np.asarray(clusters, dtype=str), return_inverse=True)
        count = len(names)
        weights = rng.multinomial(count, np.full(count, 1 / count), size=draws)
        return cls(weights.astype(np.float64), codes, confidence)

    @property
    def is_possible(self) -> bool:
        """Whether there are at least two clusters: one alone says nothing about the spread."""
        return len(self.weights.T) > 1

    def for_rows(self, rows: NDArray[np.intp]) -> "Resampler":
        """Return the resampler of other rows, given the present row each one belongs to."""
        return Resampler(self.weights, self.clusters[rows], self.confidence)

    def totals(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (draw, ...) weighted sums of (row, ...) values."""
        shape = (self.weights.shape[1], int(np.prod(values.shape[1:])))
        sums = np.zeros(shape)
        np.add.at(sums, self.clusters, values.reshape(len(values), -1))
        return (self.weights @ sums).reshape(-1, *values.shape[1:])

    def row_weights(self) -> NDArray[np.float64]:
        """Return (draw, row), how often a draw takes each row."""
        return self.weights[:, self.clusters]

    def interval(self, drawn: NDArray[np.float64]) -> Interval:
        """Return the percentile interval of (draw,) values, leaving out undefined draws.

        Infinite values are in order and may be a bound; the quantile is therefore one of the
        values.
        """
        known = drawn[~np.isnan(drawn)]
        if not self.is_possible or not len(known):
            return UNKNOWN
        tail = (1 - self.confidence) / 2
        low, high = np.quantile(known, [tail, 1 - tail], method="inverted_cdf")
        return float(low), float(high)


def bin_edges(scores: NDArray[np.float64], bins: int) -> NDArray[np.float64]:
    """Return the upper edges (at most ``bins``) of quantile bins of (sample,) scores."""
    if not len(scores):
        return np.zeros(1)
    return np.unique(np.quantile(scores, np.arange(1, bins + 1) / bins, method="inverted_cdf"))


def bin_counts(
    scores: NDArray[np.float64], labels: NDArray[np.bool_], edges: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (2, bin) counts of undisturbed and disturbed samples; a bin includes its edge."""
    index = np.searchsorted(edges, scores, side="left")
    bins = len(edges)
    joint = np.bincount(index + bins * labels, minlength=2 * bins)
    return joint.reshape(2, bins).astype(np.float64)


def shift_interval(interval: Interval, offset: float) -> Interval:
    """Return a share's interval moved by what binning took from it, within 0 and 1.

    The spread comes from binned scores, the value from exact ones; the difference of the two
    values is known, so it needn't blur the interval.
    """
    low, high = (float(np.clip(bound + offset, 0.0, 1.0)) for bound in interval)
    return low, high


def weighted_quantile(
    values: NDArray[np.float64], weights: NDArray[np.float64], share: float
) -> NDArray[np.float64]:
    """Return (draw,) the smallest value that a share of the weight doesn't exceed.

    (row,) values, inf allowed; (draw, row) weights. NaN where a draw has no weight.
    """
    order = np.argsort(values, kind="stable")
    cumulated = np.cumsum(weights[:, order], axis=1)
    if not len(values):
        return np.full(len(weights), np.nan)
    total = cumulated[:, -1]
    # The small allowance keeps 0.9 * 10 from asking for the tenth of ten.
    first = np.argmax(cumulated >= (share * total - 1e-9)[:, None], axis=1)
    return np.where(total > 0, values[order][first], np.nan)
