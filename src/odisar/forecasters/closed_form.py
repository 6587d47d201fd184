"""Closed-form forecasts: ridge regression on the last samples and their products (NARX).

A nonlinear autoregressive model with exogenous inputs that is linear in its weights (Billings,
Nonlinear System Identification, 2013, chapter 2): the last L samples, all products of two features
of the last sample, and its signed squares (drag). It is fitted once, on training windows, by
normal equations; nothing iterates and nothing is random.
"""

from collections.abc import Callable

import torch
from torch import nn

from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import Batch

#: Windows whose products are summed at a time; a matter of memory, not of results.
_CHUNK = 4096
#: Ridge penalty per window, in units of the (standardised) design: keeps collinear lags apart.
_RIDGE = 1.0e-6
#: A target that never varies leaves no error; dividing by this keeps it at zero.
_SMALLEST_SPREAD = 1.0e-4


def design_width(features: int, lags: int) -> int:
    """Return how many regressors a sample of so many features has."""
    return lags * features + features * (features + 1) // 2 + features + 1


def design(context: torch.Tensor, lags: int) -> torch.Tensor:
    """Return (window, regressor) from context (window, step, feature), scaled.

    The last ``lags`` samples, newest last; products of two features of the newest; its signed
    squares; one.
    """
    last = context[:, -1]
    first, second = torch.triu_indices(last.shape[1], last.shape[1])
    return torch.cat(
        [
            context[:, -lags:].flatten(1),
            last[:, first] * last[:, second],
            last * last.abs(),
            torch.ones_like(last[:, :1]),
        ],
        dim=1,
    )


class ClosedForm(nn.Module):
    """A fitted closed form: ``weights`` (regressor, target), and what it leaves.

    ``spread`` (target,) is the root mean squared error on the training windows, in scaled units.
    Both are buffers: they travel with a network's weights, and no optimiser touches them.
    """

    weights: torch.Tensor
    spread: torch.Tensor

    def __init__(self, features: int, lags: int, targets: int) -> None:
        super().__init__()
        self.lags = lags
        self.register_buffer("weights", torch.zeros(design_width(features, lags), targets))
        self.register_buffer("spread", torch.ones(targets))

    def forward(self, context: torch.Tensor) -> torch.Tensor:
        """Return (window, target) forecasts from context (window, step, feature), scaled."""
        return design(context, self.lags) @ self.weights

    @torch.no_grad()
    def fit(self, windows: WindowSet, target_of: Callable[[Batch], torch.Tensor]) -> None:
        """Fit on all windows; ``target_of`` takes (window, target) from a batch."""
        regressors, targets = self.weights.shape
        gram = torch.zeros(regressors, regressors, dtype=torch.float64)
        cross = torch.zeros(regressors, targets, dtype=torch.float64)
        squares = torch.zeros(targets, dtype=torch.float64)
        for start in range(0, len(windows), _CHUNK):
            batch = windows.gather(torch.arange(start, min(start + _CHUNK, len(windows))))
            x, y = design(batch.context, self.lags).double(), target_of(batch).double()
            gram += x.T @ x
            cross += x.T @ y
            squares += (y**2).sum(dim=0)
        penalty = _RIDGE * len(windows) * torch.eye(regressors, dtype=torch.float64)
        weights = torch.linalg.solve(gram + penalty, cross)
        # |y - Xw|^2 from the same sums, so that the windows are gone through once.
        left = squares - 2 * (weights * cross).sum(dim=0) + (weights * (gram @ weights)).sum(dim=0)
        spread = (left / len(windows)).clamp(min=0).sqrt().clamp(min=_SMALLEST_SPREAD)
        self.weights.copy_(weights)
        self.spread.copy_(spread)
