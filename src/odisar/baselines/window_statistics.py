"""What is left of a context when its course is forgotten: six numbers a feature."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: The statistics of a feature, in the order in which they stand.
STATISTICS = (
    "mean",
    "standard deviation",
    "standard deviation of first differences",
    "slope per step",
    "last value",
    "range",
)


def window_statistics(contexts: FloatArray) -> FloatArray:
    """Return (context, statistic x feature) of (context, step, feature), in the contexts' units.

    The statistics stand in the order of ``STATISTICS``, each for all features. The slope is that
    of the least squares line. A context of one step has no differences and no slope: zero.
    """
    # Steps last and side by side: reducing over a middle axis takes several times as long.
    last = contexts[:, -1]
    # Less the last value, so that what stands still has a spread of exactly zero, not of rounding.
    course = np.ascontiguousarray(np.swapaxes(contexts - last[:, None], 1, 2))
    steps = course.shape[-1]
    mean = course.mean(axis=-1)
    lean = np.arange(steps) - (steps - 1) / 2
    parts = [
        last + mean,
        course.std(axis=-1),
        np.diff(course, axis=-1).std(axis=-1) if steps > 1 else np.zeros_like(mean),
        course @ (lean / max(float(lean @ lean), 1.0)),
        last,
        np.ptp(course, axis=-1),
    ]
    return np.concatenate(parts, axis=1)
