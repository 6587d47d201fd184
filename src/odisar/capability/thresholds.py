"""Thresholds from calibration recordings, which nothing else has seen."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.errors import OdisarError

_SECONDS_PER_HOUR = 3600.0

#: A gapless run of undisturbed scores: its cluster, (time,) scores, and their spacing in seconds.
CalibrationRun = tuple[str, NDArray[np.float64], float]


def sigma_threshold(scores: NDArray[np.floating], sigmas: float) -> float:
    """Return mu + k sigma of calibration scores (paper, Eq. (thresholds)); NaN scores don't count.

    Raises OdisarError where there are too few scores to have a spread.
    """
    known = _known_scores(scores)
    return float(known.mean() + sigmas * known.std())


def log_sigma_threshold(scores: NDArray[np.floating], sigmas: float) -> float:
    """Return exp(mu + k sigma) of the logarithms of calibration scores; NaN scores don't count.

    Squared errors have a long upper tail, and the logarithm of their mean is nearer to normal
    (Bartlett and Kendall, Supplement to the JRSS 1946), so k means more nearly what it means for a
    normal distribution. The threshold is on the scores' own scale.

    Raises OdisarError where there are too few scores to have a spread, or one isn't above zero.
    """
    known = _known_scores(scores)
    if known.min() <= 0:
        raise OdisarError(
            f"a calibration score of {known.min():g} has no logarithm; a threshold on logarithms "
            "needs scores above zero, so take another rule for this detector"
        )
    logarithms = np.log(known)
    return float(np.exp(logarithms.mean() + sigmas * logarithms.std()))


def _known_scores(scores: NDArray[np.floating]) -> NDArray[np.float64]:
    known: NDArray[np.float64] = scores[np.isfinite(scores)].astype(np.float64)
    if known.size < 2:
        raise OdisarError(
            f"{known.size} calibration scores cannot set a threshold; add calibration recordings "
            "or shorten the window"
        )
    return known


@dataclass(frozen=True)
class ConformalThreshold:
    """A threshold with what it promises: a fresh block alarms with probability ``alpha`` at most.

    The promise is marginal (over calibration and the fresh block together) and rests on clusters
    of recordings that are exchangeable with the fresh one. ``asked_per_hour`` is the rate that was
    asked for, ``promised_per_hour`` the one that ``alpha`` stands for if alarms come one by one; a
    block that alarms may do so often, which no promise about blocks bounds. ``clusters`` and
    ``blocks`` are those behind it.
    """

    threshold: float
    alpha: float
    block_s: float
    asked_per_hour: float
    promised_per_hour: float
    clusters: int
    blocks: int

    @property
    def is_weaker(self) -> bool:
        """Whether the calibration recordings are too few for what was asked."""
        return self.promised_per_hour > self.asked_per_hour

    @property
    def promise(self) -> str:
        """Return the promise as a sentence, with the shortfall where there is one."""
        kept = (
            f"at most {self.alpha:.1%} of fresh blocks of {self.block_s / 60:.3g} min raise an "
            f"alarm ({self.promised_per_hour:.3g} per hour if they come one by one), as calibrated "
            f"on {self.blocks} blocks of {self.clusters} independent recordings"
        )
        if not self.is_weaker:
            return kept
        needed = clusters_needed(self.asked_per_hour, self.block_s)
        return (
            f"{kept}; this is weaker than the {self.asked_per_hour:.3g} per hour asked for, which "
            f"needs {needed} independent recordings"
        )


def conformal_threshold(
    runs: Sequence[CalibrationRun], rate_per_hour: float, persistence_s: float, block_s: float
) -> ConformalThreshold:
    """Return the split-conformal threshold on how high a block's lasting score ever gets.

    Parameters
    ----------
    runs
        Undisturbed calibration scores. Runs of one cluster (those that share a base seed) depend
        on one another, and count as one observation however many they are.
    rate_per_hour
        Alarms per hour to promise.
    persistence_s
        How long the score must exceed the threshold to raise an alarm.
    block_s
        Scored time of one block, in seconds. Runs are cut into whole blocks from their first
        score; what is left over has no part in it. Short blocks ask for more clusters: the whole
        recording is a good block (``longest_shared_block_s``).

    Notes
    -----
    With m the lowest of the last scores over the persistence, a block raises an alarm at T if and
    only if the maximum of m over the block exceeds T. That maximum, M, is one value per block. If
    alarms came as a Poisson process at the promised rate r, a block of b hours would have one with
    probability alpha = 1 - exp(-r b); T is chosen so that a fresh M exceeds it with no more:

    With one block in each of n clusters, T is the ceil((n + 1)(1 - alpha))-th smallest M (split
    conformal prediction; Vovk, Gammerman and Shafer, Algorithmic Learning in a Random World, 2005;
    for alarms on vessels Laxhammar and Falkman, StreamKDD 2010). It equals flagging where the
    conformal p-value of M is at most alpha (Bates, Candes, Lei, Romano and Sesia, Annals of
    Statistics 2023). With several blocks in a cluster, each has an equal share of the cluster's
    weight 1 / (n + 1), and T is the smallest M at which the weights sum to 1 - alpha (Lee, Barber
    and Willett, Distribution-free inference with hierarchical data, 2023).

    No n clusters can promise less than alpha = 1 / (n + 1). Where less is asked, the threshold is
    the largest M and the promise is that one: ``is_weaker`` says so, ``promise`` in words.

    Raises
    ------
    OdisarError
        If the rate isn't above zero, a block is no longer than the persistence, or no run holds a
        whole block.
    """
    if rate_per_hour <= 0 or block_s <= persistence_s:
        raise OdisarError(
            f"rate_per_hour={rate_per_hour:g} must be above zero, and block_s={block_s:g} longer "
            f"than persistence_s={persistence_s:g}"
        )
    peaks: dict[str, list[float]] = defaultdict(list)
    for cluster, scores, spacing_s in runs:
        peaks[cluster] += _block_peaks(scores, spacing_s, persistence_s, block_s)
    held = [own for own in peaks.values() if own]
    if not held:
        raise OdisarError(
            f"no calibration run has {block_s:g} s of scores, the length of a block; shorten the "
            "blocks or add longer calibration recordings"
        )
    hours = block_s / _SECONDS_PER_HOUR
    asked = float(-np.expm1(-rate_per_hour * hours))
    alpha = max(asked, 1 / (len(held) + 1))
    return ConformalThreshold(
        threshold=_weighted_conformal_quantile(held, alpha),
        alpha=alpha,
        block_s=block_s,
        asked_per_hour=rate_per_hour,
        promised_per_hour=rate_per_hour if alpha == asked else float(-np.log1p(-alpha)) / hours,
        clusters=len(held),
        blocks=sum(len(own) for own in held),
    )


def clusters_needed(rate_per_hour: float, block_s: float) -> int:
    """Return how many clusters can promise a rate with blocks of a length: 1 / alpha - 1."""
    alpha = -np.expm1(-rate_per_hour * block_s / _SECONDS_PER_HOUR)
    return max(1, int(np.ceil(1 / alpha - 1 - 1e-9)))


def longest_shared_block_s(runs: Sequence[CalibrationRun]) -> float:
    """Return the length in seconds of the longest block that every cluster with scores holds.

    Raises OdisarError if no run has a score.
    """
    longest: dict[str, float] = {}
    for cluster, scores, spacing_s in runs:
        length_s = len(_scored_part(scores)) * spacing_s
        longest[cluster] = max(longest.get(cluster, 0.0), length_s)
    lengths = [length_s for length_s in longest.values() if length_s > 0]
    if not lengths:
        raise OdisarError("no calibration run has a score; add undisturbed calibration recordings")
    return min(lengths)


def _scored_part(scores: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the scores from the first known one to the last."""
    known = np.flatnonzero(np.isfinite(scores))
    return scores[known[0] : known[-1] + 1] if len(known) else scores[:0]


def _block_peaks(
    scores: NDArray[np.float64], spacing_s: float, persistence_s: float, block_s: float
) -> list[float]:
    """Return the maximum over each whole block of the lowest score over the persistence."""
    scored = _scored_part(scores)
    width = max(1, int(np.ceil(persistence_s / spacing_s - 1e-9)))
    size = max(1, int(block_s / spacing_s + 1e-9))
    blocks = len(scored) // size
    if blocks == 0:
        return []
    known = np.where(np.isfinite(scored), scored, -np.inf)
    padded = np.concatenate([np.full(width - 1, -np.inf), known])
    lasting = np.lib.stride_tricks.sliding_window_view(padded, width).min(axis=-1)
    peaks = lasting[: blocks * size].reshape(blocks, size).max(axis=1)
    return [float(peak) for peak in peaks if np.isfinite(peak)]


def _weighted_conformal_quantile(peaks: Sequence[Sequence[float]], alpha: float) -> float:
    """Return the smallest peak with weight 1 - alpha at or below it; a cluster weighs 1/(n + 1)."""
    values = np.concatenate([np.asarray(own, dtype=np.float64) for own in peaks])
    weights = np.concatenate([np.full(len(own), 1 / len(own)) for own in peaks])
    order = np.argsort(values, kind="stable")
    cumulated = np.cumsum(weights[order])
    # The allowance keeps rounding from asking for one block more than there are.
    wanted = min((len(peaks) + 1) * (1 - alpha), len(peaks)) - 1e-9
    return float(values[order][np.searchsorted(cumulated, wanted)])
