"""The twin's network: a Transformer that forecasts, and reconstructs its own forecast.

The paper's encoder-decoder (section "Creating DTM"), made causal. The decoder never sees a state
after t: its input is one learned query for each patch of the horizon, the last observed sample,
and, only where a case declares them known ahead, the commands of the horizon.
"""

from dataclasses import dataclass
from typing import cast

import torch
from torch import nn

from odisar.config.learning import TwinConfig
from odisar.twin.layers import DecoderLayer, Dropout, EncoderLayer
from odisar.windows.windowing import WindowSpec


@dataclass(frozen=True)
class TwinOutput:
    """``forecast`` and ``reconstruction`` (window, horizon step, state), scaled."""

    forecast: torch.Tensor
    reconstruction: torch.Tensor


class TwinTransformer(nn.Module):
    """Encoder over the context, decoder over the horizon, two heads on the decoder's output."""

    def __init__(self, config: TwinConfig, spec: WindowSpec, features: int) -> None:
        super().__init__()
        self.spec = spec
        self.patch_steps = config.patch_steps
        context_tokens = spec.context_steps // config.patch_steps
        horizon_tokens = spec.horizon_steps // config.patch_steps
        width, states = config.model_dim, len(spec.outputs)
        layer = (width, config.heads, config.feedforward_dim, config.dropout)

        self.embed = nn.Linear(config.patch_steps * features, width)
        self.context_position = nn.Parameter(0.02 * torch.randn(context_tokens, width))
        self.embed_dropout = Dropout(config.dropout, context_tokens, width)
        self.encoder = nn.ModuleList(
            EncoderLayer(*layer, context_tokens) for _ in range(config.layers)
        )
        self.memory_norm = nn.LayerNorm(width)

        self.query = nn.Parameter(0.02 * torch.randn(horizon_tokens, width))
        self.embed_last = nn.Linear(features, width)
        self.embed_known = (
            nn.Linear(config.patch_steps * len(spec.known_ahead), width)
            if spec.known_ahead
            else None
        )
        self.decoder = nn.ModuleList(
            DecoderLayer(*layer, horizon_tokens) for _ in range(config.layers)
        )
        self.output_norm = nn.LayerNorm(width)
        self.forecast_head = nn.Linear(width, config.patch_steps * states)
        self.reconstruction_head = nn.Sequential(
            nn.Linear(width, config.reconstruction_dim),
            nn.ReLU(),
            nn.Linear(config.reconstruction_dim, config.patch_steps * states),
        )

    def encode(self, context: torch.Tensor) -> torch.Tensor:
        """Return memory (window, context token, feature) from context (window, step, feature)."""
        x = self.embed_dropout(self.embed(self._patch(context)) + self.context_position)
        for layer in self.encoder:
            x = layer(x)
        return cast("torch.Tensor", self.memory_norm(x))

    def decode(
        self, memory: torch.Tensor, last: torch.Tensor, known_future: torch.Tensor
    ) -> TwinOutput:
        """Forecast and reconstruct the horizon.

        ``memory`` (window, context token, feature), ``last`` (window, feature) the sample at t,
        ``known_future`` (window, horizon step, command), empty unless commands are known ahead.
        """
        x = self.query + self.embed_last(last)[:, None]
        if self.embed_known is not None:
            x = x + self.embed_known(self._patch(known_future))
        for layer in self.decoder:
            x = cast("DecoderLayer", layer).decode(x, memory)
        x = self.output_norm(x)
        return TwinOutput(
            self._unpatch(self.forecast_head(x)), self._unpatch(self.reconstruction_head(x))
        )

    def forward(self, context: torch.Tensor, known_future: torch.Tensor) -> TwinOutput:
        """Run encoder and decoder on context (window, context step, feature), scaled."""
        return self.decode(self.encode(context), context[:, -1], known_future)

    def _patch(self, steps: torch.Tensor) -> torch.Tensor:
        """Return (window, token, patch step x feature) from (window, step, feature)."""
        return steps.reshape(len(steps), -1, self.patch_steps * steps.shape[2])

    def _unpatch(self, patches: torch.Tensor) -> torch.Tensor:
        """Return (window, step, state) from (window, token, patch step x state)."""
        return patches.reshape(len(patches), -1, len(self.spec.outputs))
