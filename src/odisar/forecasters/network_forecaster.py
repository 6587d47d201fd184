"""What all forecasters that are networks have in common: how they are fitted and asked."""

from abc import ABC, abstractmethod
from collections.abc import Callable

import torch
import torch.nn.functional as F
from torch import nn

from odisar.errors import OdisarError
from odisar.fitting import FitBudget, FitRecord, Lesson, fit_network, seeded
from odisar.forecasters.interface import WindowShape, check_windows
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import Batch

#: From a network in training and a batch to the loss that is minimised.
Objective = Callable[[nn.Module, Batch], torch.Tensor]

#: Validation windows gathered at a time; a matter of memory and time, not of results.
_HELD_OUT_BATCH = 1024


class NetworkForecaster(ABC):
    """A forecaster that is fitted by ``fitting.fit_network``; kinds of it say which network."""

    def __init__(self, budget: FitBudget, seed: int) -> None:
        self.budget, self.seed = budget, seed
        self._network: nn.Module | None = None
        self._record: FitRecord | None = None

    @abstractmethod
    def build(self, shape: WindowShape) -> nn.Module:
        """Return a fresh network; its random numbers are torch's, which ``fit`` has seeded."""

    def objective(self, shape: WindowShape) -> Objective:  # noqa: ARG002
        """Return what is minimised: the squared error, unless a kind of network says otherwise."""
        return mean_squared_error

    @property
    def record(self) -> FitRecord:
        """How the fit went, by mean squared error; raises OdisarError before ``fit``."""
        if self._record is None:
            raise OdisarError(f"{type(self).__name__} is not fitted yet; call fit first")
        return self._record

    @property
    def network(self) -> nn.Module:
        """The fitted network; raises OdisarError before ``fit``."""
        if self._network is None:
            raise OdisarError(f"{type(self).__name__} is not fitted yet; call fit first")
        return self._network

    def fit(self, train: WindowSet, validation: WindowSet) -> None:
        """Fit a fresh network: the seed, the budget and the windows decide everything."""
        check_windows(train, validation)
        shape = WindowShape.of(train)
        with seeded(self.seed, "weights"):
            network, objective = self.build(shape), self.objective(shape)
        lesson = Lesson(
            type(self).__name__,
            lambda batch: objective(network, batch),
            train,
            validation,
            error=lambda batch: mean_squared_error(network, batch),
            held_out_batch=_HELD_OUT_BATCH,
        )
        self._record = fit_network(network, lesson, self.budget, self.seed)
        self._network = network

    def forecast(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:
        """Return (window, horizon step, state), scaled."""
        with torch.no_grad():
            found: torch.Tensor = self.network(context, known_future)
        return found


def mean_squared_error(network: nn.Module, batch: Batch) -> torch.Tensor:
    """Return the mean over windows, steps and states, as the twin's forecast loss."""
    return F.mse_loss(network(batch.context, batch.known_future), batch.truth)
