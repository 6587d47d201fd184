"""A linear forecast of the whole horizon at once, in closed form.

One ridge regression for every step and state (the direct strategy; Chevillon 2007, Journal of
Economic Surveys) on lagged features, squares and products of the last sample, and the commands of
the horizon where they are known ahead. Linear maps of a window are hard to beat by networks
(Zeng et al. 2023, AAAI); the products let lift and drag in, which grow with speed squared.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from odisar.errors import OdisarError
from odisar.forecasters.interface import WindowShape, check_windows
from odisar.forecasters.last_state import LastStates
from odisar.forecasters.moments import Moments
from odisar.windows.coordinates import FloatArray
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import Batch, WindowSpec


@dataclass(frozen=True)
class DirectDesign:
    """Which columns a window becomes: what a direct linear forecast is linear in.

    In order: one constant, products of the last sample's features, the known commands of the
    horizon, and the last ``lags_steps`` samples, the newest first.
    """

    lags_steps: int

    def __call__(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:
        """Return (window, column) from scaled context and known future (see ``Forecaster``)."""
        last = context[:, -1]
        rows, columns = torch.triu_indices(last.shape[1], last.shape[1])
        lags = context[:, -self.lags_steps :].flip(1)
        return torch.cat(
            [
                torch.ones_like(last[:, :1]),
                last[:, rows] * last[:, columns],
                known_future.flatten(1),
                lags.flatten(1),
            ],
            dim=1,
        )

    def width(self, shape: WindowShape) -> int:
        """Return how many columns windows of a shape become."""
        products = shape.features * (shape.features + 1) // 2
        known = shape.horizon_steps * shape.commands
        return 1 + products + known + self.lags_steps * shape.features


@dataclass(frozen=True)
class DirectWeights:
    """A fitted direct linear forecast: a design, and ``weights`` (column, step x state)."""

    design: DirectDesign
    weights: torch.Tensor
    penalty: float
    states: int

    def forecast(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:
        """Return (window, horizon step, state), scaled."""
        flat = self.design(context, known_future) @ self.weights
        return flat.view(len(flat), -1, self.states)


class DirectLinear:
    """Direct multi-horizon ridge; lags and penalty are those with the least validation error.

    Weights are drawn towards persistence, not towards zero: of a state that hardly moves in few
    recordings, no better is known. ``lags_steps`` and ``penalties`` are what may be chosen; lags
    beyond the context are left out.
    """

    def __init__(
        self,
        scaler: Scaler,
        spec: WindowSpec,
        lags_steps: Sequence[int],
        penalties: Sequence[float],
    ) -> None:
        self._last = LastStates.of(scaler, spec)
        self._lags_steps = tuple(lags for lags in lags_steps if lags <= spec.context_steps)
        self._penalties = tuple(penalties)
        self._fitted: DirectWeights | None = None
        if not self._lags_steps:
            raise OdisarError(
                f"lags_steps={list(lags_steps)} are all longer than the context of "
                f"{spec.context_steps} steps; offer a shorter one"
            )

    @property
    def fitted(self) -> DirectWeights:
        """What was fitted; raises OdisarError before ``fit``."""
        if self._fitted is None:
            raise OdisarError("the direct linear forecast has no weights yet; call fit first")
        return self._fitted

    def fit(self, train: WindowSet, validation: WindowSet) -> None:
        """Solve the normal equations for every choice of lags and penalty, and keep the best."""
        check_windows(train, validation)
        shape = WindowShape.of(train)
        widest = DirectDesign(max(self._lags_steps))

        def columns(batch: Batch) -> torch.Tensor:
            return widest(batch.context.double(), batch.known_future.double())

        seen, unseen = Moments.of(train, columns), Moments.of(validation, columns)
        best = np.inf
        for lags in self._lags_steps:
            design = DirectDesign(lags)
            kept = np.arange(design.width(shape))
            narrow, judge = seen.of_columns(kept), unseen.of_columns(kept)
            towards = self._persistence(design, shape)
            for penalty in self._penalties:
                weights = narrow.ridge(penalty, towards)
                error = float(judge.squared_errors(weights).mean())
                if error < best:
                    best = error
                    fixed = torch.from_numpy(weights).float()
                    self._fitted = DirectWeights(design, fixed, penalty, shape.states)

    def forecast(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:
        """Return (window, horizon step, state), scaled."""
        return self.fitted.forecast(context, known_future)

    def _persistence(self, design: DirectDesign, shape: WindowShape) -> FloatArray:
        """Return (column, step x state) weights that hold every state outside the pose."""
        weights = np.zeros((design.width(shape), shape.horizon_steps, shape.states))
        newest = design.width(shape) - design.lags_steps * shape.features
        slope, offset = self._last.rescaling()
        for i, state in enumerate(self._last.plain):
            weights[0, :, state] = offset[i]
            weights[newest + self._last.places[i], :, state] = slope[i]
        return weights.reshape(len(weights), -1)
