"""Least squares of whole horizons from sums over windows: nothing but a batch is ever in memory."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from odisar.windows.coordinates import FloatArray
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import Batch

#: Windows gathered at a time; a matter of memory, not of results.
_BATCH = 1024


def batches(windows: WindowSet) -> Iterator[Batch]:
    """Return all windows once, in order, a batch at a time."""
    for start in range(0, len(windows), _BATCH):
        yield windows.gather(torch.arange(start, min(start + _BATCH, len(windows))))


@dataclass(frozen=True)
class Moments:
    """Sums over windows that decide every least-squares fit on these columns, and its error.

    ``gram`` (column, column) of the design with itself, ``cross`` (column, target) with the
    targets, ``squares`` (target,) of the targets, ``windows`` how many were summed.
    """

    gram: FloatArray
    cross: FloatArray
    squares: FloatArray
    windows: int

    @classmethod
    def of(cls, windows: WindowSet, design: Callable[[Batch], torch.Tensor]) -> "Moments":
        """Sum over all windows the products of a (window, column) design and their targets."""
        gram = cross = squares = np.zeros(())
        for batch in batches(windows):
            columns = design(batch).double().numpy()
            targets = batch.truth.flatten(1).double().numpy()
            gram = gram + columns.T @ columns
            cross = cross + columns.T @ targets
            squares = squares + np.sum(targets**2, axis=0)
        return cls(gram, cross, squares, len(windows))

    def of_columns(self, columns: NDArray[np.intp]) -> "Moments":
        """Return the moments of a narrower design."""
        return Moments(
            self.gram[np.ix_(columns, columns)], self.cross[columns], self.squares, self.windows
        )

    def ridge(self, penalty: float, towards: FloatArray) -> FloatArray:
        """Return (column, target) ridge weights (Hoerl and Kennard 1970, Technometrics).

        The penalty counts per window, on the distance from the weights ``towards`` (column,
        target); the first column, the constant, is not penalised.
        """
        shrink = np.full(len(self.gram), penalty * self.windows)
        shrink[0] = 0.0
        left = self.cross - self.gram @ towards
        return towards + np.linalg.solve(self.gram + np.diag(shrink), left)

    def squared_errors(self, weights: FloatArray) -> FloatArray:
        """Return (target,) mean squared errors that these weights have on these windows."""
        explained = 2.0 * np.sum(weights * self.cross, axis=0)
        size = np.sum(weights * (self.gram @ weights), axis=0)
        return np.asarray((self.squares - explained + size) / self.windows, dtype=np.float64)
