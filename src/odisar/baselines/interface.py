"""What every detector that can be compared here has in common: fit on undisturbed, then score."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from odisar.config.cases import Case
from odisar.recordings.schema import Recording
from odisar.windows.scaling import Scaler
from odisar.windows.windowing import WindowSpec


@dataclass(frozen=True)
class Reference:
    """Undisturbed recordings that a detector may learn from, and how they are windowed.

    ``train`` fits models; ``held_out`` (the validation recordings) says how large errors are on
    recordings that were not fitted. ``spec`` and ``scaler`` are the twin's, fitted on ``train``.
    """

    case: Case
    spec: WindowSpec
    scaler: Scaler
    train: Sequence[Recording]
    held_out: Sequence[Recording]
    seed: int


class Detector(Protocol):
    """A score of recordings, sample by sample; higher is more abnormal."""

    def fit(self, reference: Reference) -> None:
        """Learn what is normal. Nothing but the reference may be looked at, then or later."""
        ...

    def score(self, recordings: Sequence[Recording]) -> list[NDArray[np.float64]]:
        """Return for each recording (sample,) what is known at that sample; NaN where nothing is.

        All recordings are given at once so that a detector which mixes them can be told from one
        that doesn't (``evaluation.leakage``). Scores are above zero.
        """
        ...


def context_positions(recording: Recording, spec: WindowSpec) -> NDArray[np.int64]:
    """Return (window,) the samples of a recording that have a whole context behind them."""
    parts = [spec.issue_positions(segment, 1, horizon_steps=0) for segment in recording.segments]
    return np.concatenate([np.empty(0, dtype=np.int64), *parts])


def at_samples(
    values: NDArray[np.float64], positions: NDArray[np.int64], samples: int
) -> NDArray[np.float64]:
    """Return (sample,) the values (window,) at their positions, NaN elsewhere."""
    placed = np.full(samples, np.nan)
    placed[positions] = values
    return placed
