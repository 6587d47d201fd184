"""What the paper's pilot study compared the Transformer with: kinds of RNN, VAE and GAN.

The paper (section "Creating DTM") names the kinds and nothing else, so these are plain members of
each kind, small, and fitted with the same budget as the others.
"""

from dataclasses import dataclass
from typing import cast

import torch
import torch.nn.functional as F
from torch import nn

from odisar.fitting import FitBudget
from odisar.forecasters.interface import WindowShape
from odisar.forecasters.network_forecaster import NetworkForecaster, Objective
from odisar.windows.windowing import Batch


@dataclass(frozen=True)
class RnnSize:
    """Width of the recurrent state."""

    state_dim: int


class RnnNetwork(nn.Module):
    """LSTM (Hochreiter and Schmidhuber 1997) that goes on through the horizon, step by step.

    In the horizon it reads its own forecast of the step before, and the known commands.
    """

    def __init__(self, size: RnnSize, shape: WindowShape) -> None:
        super().__init__()
        self.shape = shape
        self.encoder = nn.LSTM(shape.features, size.state_dim, batch_first=True)
        self.cell = nn.LSTMCell(shape.states + shape.commands, size.state_dim)
        self.read_out = nn.Linear(size.state_dim, shape.states)

    def forward(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:
        """Return (window, horizon step, state), scaled."""
        _, (hidden, memory) = self.encoder(context)
        hidden, memory = hidden[0], memory[0]
        state = self.read_out(hidden)
        steps = []
        for step in range(self.shape.horizon_steps):
            read = torch.cat([state, known_future[:, step]], dim=1)
            hidden, memory = self.cell(read, (hidden, memory))
            state = self.read_out(hidden)
            steps.append(state)
        return torch.stack(steps, dim=1)


class RnnForecaster(NetworkForecaster):
    """An LSTM fitted to the squared error of the horizon."""

    def __init__(self, size: RnnSize, budget: FitBudget, seed: int) -> None:
        super().__init__(budget, seed)
        self._size = size

    def build(self, shape: WindowShape) -> nn.Module:
        """Return a fresh network."""
        return RnnNetwork(self._size, shape)


@dataclass(frozen=True)
class GenerativeSize:
    """Widths of hidden layers and latent variables; ``weight`` of the loss that isn't the error.

    That is the divergence from the prior (VAE), or the critic's verdict (GAN).
    """

    hidden_dim: int
    latent_dim: int
    weight: float


class Generator(nn.Module):
    """From a summary of the window and latent variables to a forecast.

    ``forward`` takes the latent variables as zero, the centre of their prior: one forecast for a
    window, the same every time.
    """

    def __init__(self, size: GenerativeSize, shape: WindowShape) -> None:
        super().__init__()
        self.shape, self.latent_dim = shape, size.latent_dim
        seen = shape.context_steps * shape.features + shape.horizon_steps * shape.commands
        hidden = size.hidden_dim
        self.summary = nn.Sequential(nn.Linear(seen, hidden), nn.ReLU(), nn.Linear(hidden, hidden))
        self.decoder = nn.Sequential(
            nn.Linear(hidden + size.latent_dim, hidden),
            nn.ReLU(),
            nn.Linear(hidden, shape.horizon_steps * shape.states),
        )

    def summarise(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:
        """Return (window, hidden) what is known when the forecast is issued."""
        seen = torch.cat([context.flatten(1), known_future.flatten(1)], dim=1)
        return cast("torch.Tensor", self.summary(seen))

    def decode(self, summary: torch.Tensor, latent: torch.Tensor) -> torch.Tensor:
        """Return (window, horizon step, state) for latent variables (window, latent)."""
        flat: torch.Tensor = self.decoder(torch.cat([summary, latent], dim=1))
        return flat.view(-1, self.shape.horizon_steps, self.shape.states)

    def forward(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:
        """Return (window, horizon step, state), scaled."""
        summary = self.summarise(context, known_future)
        return self.decode(summary, summary.new_zeros(len(summary), self.latent_dim))


class VaeNetwork(Generator):
    """Conditional variational autoencoder of the horizon (Sohn, Lee and Yan 2015, NeurIPS).

    In training an encoder sees the truth and says which latent variables stand for it.
    """

    def __init__(self, size: GenerativeSize, shape: WindowShape) -> None:
        super().__init__(size, shape)
        truth = shape.horizon_steps * shape.states
        self.encoder = nn.Sequential(
            nn.Linear(truth + size.hidden_dim, size.hidden_dim),
            nn.ReLU(),
            nn.Linear(size.hidden_dim, 2 * size.latent_dim),
        )

    def loss(self, batch: Batch, weight: float) -> torch.Tensor:
        """Return squared error and weighted divergence from the standard normal prior."""
        summary = self.summarise(batch.context, batch.known_future)
        both = self.encoder(torch.cat([batch.truth.flatten(1), summary], dim=1))
        mean, log_variance = both.chunk(2, dim=1)
        latent = mean + torch.randn_like(mean) * torch.exp(log_variance / 2)
        error = F.mse_loss(self.decode(summary, latent), batch.truth)
        divergence: torch.Tensor = 0.5 * (mean**2 + log_variance.exp() - 1.0 - log_variance).mean()
        return error + weight * divergence


class VaeForecaster(NetworkForecaster):
    """A conditional VAE; its forecast is that of the prior's centre."""

    def __init__(self, size: GenerativeSize, budget: FitBudget, seed: int) -> None:
        super().__init__(budget, seed)
        self._size = size

    def build(self, shape: WindowShape) -> nn.Module:
        """Return a fresh network."""
        return VaeNetwork(self._size, shape)

    def objective(self, shape: WindowShape) -> Objective:  # noqa: ARG002
        """Return the negative evidence lower bound, up to constants."""
        return lambda network, batch: cast("VaeNetwork", network).loss(batch, self._size.weight)


class GanObjective:
    """Squared error and a critic's verdict (Goodfellow et al. 2014, NeurIPS; conditional).

    The critic tells observed horizons from forecast ones. It learns one step on every batch, with
    an optimiser of its own, before the generator does.
    """

    def __init__(self, size: GenerativeSize, shape: WindowShape, learning_rate: float) -> None:
        seen = shape.context_steps * shape.features + shape.horizon_steps * shape.commands
        horizon = shape.horizon_steps * shape.states
        self.critic = nn.Sequential(
            nn.Linear(seen + horizon, size.hidden_dim),
            nn.LeakyReLU(0.2),
            nn.Linear(size.hidden_dim, 1),
        )
        self._optimiser = torch.optim.Adam(self.critic.parameters(), lr=learning_rate)
        self._weight = size.weight

    def __call__(self, network: nn.Module, batch: Batch) -> torch.Tensor:
        """Teach the critic, then return the generator's loss."""
        generator = cast("Generator", network)
        summary = generator.summarise(batch.context, batch.known_future)
        latent = torch.randn(len(summary), generator.latent_dim)
        made = generator.decode(summary, latent)
        self._teach(batch, made.detach())
        verdict = self._verdict(batch, made)
        fooled = F.binary_cross_entropy_with_logits(verdict, torch.ones_like(verdict))
        return F.mse_loss(made, batch.truth) + self._weight * fooled

    def _teach(self, batch: Batch, made: torch.Tensor) -> None:
        self._optimiser.zero_grad()
        observed, forecast = self._verdict(batch, batch.truth), self._verdict(batch, made)
        loss = F.binary_cross_entropy_with_logits(
            observed, torch.ones_like(observed)
        ) + F.binary_cross_entropy_with_logits(forecast, torch.zeros_like(forecast))
        loss.backward()  # type: ignore[no-untyped-call]
        self._optimiser.step()

    def _verdict(self, batch: Batch, horizon: torch.Tensor) -> torch.Tensor:
        parts = (batch.context, batch.known_future, horizon)
        return cast("torch.Tensor", self.critic(torch.cat([p.flatten(1) for p in parts], dim=1)))


class GanForecaster(NetworkForecaster):
    """A conditional GAN with the squared error in its loss; its forecast has latent zeros."""

    def __init__(self, size: GenerativeSize, budget: FitBudget, seed: int) -> None:
        super().__init__(budget, seed)
        self._size = size

    def build(self, shape: WindowShape) -> nn.Module:
        """Return a fresh generator."""
        return Generator(self._size, shape)

    def objective(self, shape: WindowShape) -> Objective:
        """Return a loss with a fresh critic."""
        return GanObjective(self._size, shape, self.budget.learning_rate)
