"""Letting go: a score that has fallen far below its own recent peak is what windows remember."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from odisar.capability.innovations import FloatArray

#: Lower peaks, less than two and a half times as far out as what is rare, are left to the windows.
_STRONG = 2.5
#: So much, half of what lies between usual and rare, a score rises and falls within an event.
_UNDULATION = 0.5


@dataclass(frozen=True)
class Release:
    """Takes off a score what windows still hold of something strong that is over.

    A statistic of a window stays up until the last sample of a strong disturbance has left it. By
    how much the score has fallen below its peak within the last ``steps`` says that it is over:
    ``share`` of that, as far as it is more than an event's own rise and fall and the peak was
    strong, is taken off as well. What is weak leaves no such peak, and is left alone; but something
    weak that follows at once on something strong is let go of with it.
    """

    steps: int
    share: float

    def of(self, logs: FloatArray) -> FloatArray:
        """Return (time,) scores along one gapless run, given and returned on the common log scale.

        A peak is sought among the scores that are finite; NaN and infinite ones stay so.
        """
        steps = min(self.steps, len(logs) + 1)
        peaks = pd.Series(logs).rolling(steps, min_periods=1).max().to_numpy()
        fallen = peaks - np.maximum(logs + _UNDULATION, _STRONG)
        return np.asarray(logs - self.share * np.fmax(fallen, 0.0))
