"""A gated recurrent network that reads the context and forecasts the whole horizon at once."""

from dataclasses import dataclass

import torch
from torch import nn

from odisar.fitting import FitBudget
from odisar.forecasters.interface import WindowShape
from odisar.forecasters.network_forecaster import NetworkForecaster


@dataclass(frozen=True)
class GruSize:
    """Width of the recurrent state, and of the hidden layer of the head."""

    state_dim: int
    hidden_dim: int


class GruNetwork(nn.Module):
    """GRU encoder (Cho et al. 2014, EMNLP) and an MLP from its last state to all steps and states.

    The head also sees the last sample, and the commands of the horizon where they are known ahead.
    """

    def __init__(self, size: GruSize, shape: WindowShape) -> None:
        super().__init__()
        self.shape = shape
        self.encoder = nn.GRU(shape.features, size.state_dim, batch_first=True)
        known = shape.horizon_steps * shape.commands
        self.head = nn.Sequential(
            nn.Linear(size.state_dim + shape.features + known, size.hidden_dim),
            nn.ReLU(),
            nn.Linear(size.hidden_dim, shape.horizon_steps * shape.states),
        )

    def forward(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:
        """Return (window, horizon step, state), scaled."""
        _, last = self.encoder(context)
        read = torch.cat([last[0], context[:, -1], known_future.flatten(1)], dim=1)
        flat: torch.Tensor = self.head(read)
        return flat.view(-1, self.shape.horizon_steps, self.shape.states)


class GruForecaster(NetworkForecaster):
    """A GRU fitted to the squared error of the horizon."""

    def __init__(self, size: GruSize, budget: FitBudget, seed: int) -> None:
        super().__init__(budget, seed)
        self._size = size

    def build(self, shape: WindowShape) -> nn.Module:
        """Return a fresh network."""
        return GruNetwork(self._size, shape)
