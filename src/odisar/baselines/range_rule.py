"""A one-line check: a channel's mean over the context leaves a declared range."""

import numpy as np
from numpy.typing import NDArray

from odisar.config.cases import Case, RangeRule
from odisar.recordings.schema import Recording


def range_rule_scores(
    rule: RangeRule, recording: Recording, case: Case, positions: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Return (window,) how far the mean of the last w samples is from the range's middle.

    In units of half the range's width, so that the rule's own threshold is 1.
    """
    values = recording.values[:, case.channel_names.index(rule.channel)]
    context = case.window.context_steps
    sums = np.concatenate([[0.0], np.cumsum(values)])
    means = (sums[positions + 1] - sums[positions + 1 - context]) / context
    middle, half = (rule.min + rule.max) / 2, (rule.max - rule.min) / 2
    return np.asarray(np.abs(means - middle) / half, dtype=np.float32)
