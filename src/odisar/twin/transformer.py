"""The twin's network: a Transformer that forecasts, and reconstructs its own forecast.

It stands on a frozen closed form (``forecasters.closed_form``): the Transformer learns what that
leaves, in units of what that leaves, and starts from adding nothing.

The paper's encoder-decoder (section "Creating DTM"), made causal. The decoder never sees a state
after t: its input is one learned query for each patch of the horizon, the last observed sample,
and, only where a case declares them known ahead, the commands of the horizon.
"""

from dataclasses import dataclass
from typing import cast

import torch
from torch import nn

from odisar.config.learning import TwinConfig
from odisar.forecasters.closed_form import ClosedForm
from odisar.twin.layers import DecoderLayer, Dropout, EncoderLayer
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import WindowSpec


@dataclass(frozen=True)
class TwinOutput:
    """``forecast`` and ``reconstruction`` (window, horizon step, state), scaled.

    ``next_sample`` (window, state feature) is the forecast of the next sample as the twin sees it:
    every state, forecast over the horizon or not, scaled.
    """

    forecast: torch.Tensor
    reconstruction: torch.Tensor
    next_sample: torch.Tensor


class TwinTransformer(nn.Module):
    """Encoder over the context, decoder over the horizon, and heads on both.

    ``channels`` is how many channels a sample has. The closed forms are fitted by
    ``fit_closed_forms`` before training, and frozen.
    """

    def __init__(self, config: TwinConfig, spec: WindowSpec, channels: int) -> None:
        super().__init__()
        self.spec = spec
        features = spec.feature_count(channels)
        self.state_features = spec.state_features(channels)
        self.residual_forecast = config.residual_forecast
        self.patch_steps = config.patch_steps
        context_tokens = spec.context_steps // config.patch_steps
        horizon_tokens = spec.horizon_steps // config.patch_steps
        width, states = config.model_dim, len(spec.outputs)
        layer = (width, config.heads, config.feedforward_dim, config.dropout)

        #: Where the tokens end that have the closed form's samples behind them.
        self.token_ends = [
            end
            for end in range(config.patch_steps, spec.context_steps + 1, config.patch_steps)
            if end >= config.closed_form_lags
        ]

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
        self.next_head = nn.Sequential(
            nn.Linear(width + config.closed_form_lags * features, config.reconstruction_dim),
            nn.ReLU(),
            nn.Linear(config.reconstruction_dim, len(self.state_features)),
        )
        lags = config.closed_form_lags
        self.next_closed_form = ClosedForm(features, lags, len(self.state_features))
        self.horizon_closed_form = ClosedForm(features, lags, spec.horizon_steps * states)
        self._start_from_closed_form()

    def _start_from_closed_form(self) -> None:
        """Let the heads on a closed form begin with adding nothing."""
        heads = [cast("nn.Linear", self.next_head[-1])]
        heads += [self.forecast_head] if self.residual_forecast else []
        for head in heads:
            nn.init.zeros_(head.weight)
            nn.init.zeros_(head.bias)

    def fit_closed_forms(self, windows: WindowSet) -> None:
        """Fit the frozen parts on training windows."""
        states = list(self.state_features)
        self.next_closed_form.fit(windows, lambda batch: batch.next_sample[:, states])
        self.horizon_closed_form.fit(windows, lambda batch: batch.truth.flatten(1))

    @property
    def horizon_spread(self) -> torch.Tensor:
        """(horizon step, state) what the closed form of the horizon leaves, scaled."""
        return self.horizon_closed_form.spread.view(self.spec.horizon_steps, -1)

    def encode(self, context: torch.Tensor) -> torch.Tensor:
        """Return memory (window, context token, feature) from context (window, step, feature)."""
        x = self.embed_dropout(self.embed(self._patch(context)) + self.context_position)
        for layer in self.encoder:
            x = layer(x)
        return cast("torch.Tensor", self.memory_norm(x))

    def decode(
        self, memory: torch.Tensor, context: torch.Tensor, known_future: torch.Tensor
    ) -> TwinOutput:
        """Forecast and reconstruct the horizon, and forecast the next sample.

        ``memory`` (window, context token, feature) and the ``context`` (window, context step,
        feature) it was made of, ``known_future`` (window, horizon step, command), empty unless
        commands are known ahead.
        """
        x = self.query + self.embed_last(context[:, -1])[:, None]
        if self.embed_known is not None:
            x = x + self.embed_known(self._patch(known_future))
        for layer in self.decoder:
            x = cast("DecoderLayer", layer).decode(x, memory)
        x = self.output_norm(x)
        forecast = self._unpatch(self.forecast_head(x))
        reconstruction = self._unpatch(self.reconstruction_head(x))
        if self.residual_forecast:
            closed = self.horizon_closed_form(context).view_as(forecast)
            forecast = closed + self.horizon_spread * forecast
            reconstruction = closed + self.horizon_spread * reconstruction
        following = self.following_samples(memory[:, -1:], context)[:, -1]
        return TwinOutput(forecast, reconstruction, following)

    def following_samples(self, memory: torch.Tensor, context: torch.Tensor) -> torch.Tensor:
        """Return (window, token, state feature) the forecast of the sample after each token.

        ``memory`` (window, token, feature) are the last tokens of the encoder's output over
        ``context`` (window, step, feature); as the encoder is causal, each knows what came up to
        its end, and none more.
        """
        closed, lags = self.next_closed_form, self.next_closed_form.lags
        ends = self.token_ends[-memory.shape[1] :]
        seen = torch.stack([context[:, end - lags : end] for end in ends], dim=1)
        known = torch.cat([memory, seen.flatten(2)], dim=2)
        by_closed_form = closed(seen.flatten(0, 1)).unflatten(0, seen.shape[:2])
        return cast("torch.Tensor", by_closed_form + closed.spread * self.next_head(known))

    def forward(self, context: torch.Tensor, known_future: torch.Tensor) -> TwinOutput:
        """Run encoder and decoder on context (window, context step, feature), scaled."""
        return self.decode(self.encode(context), context, known_future)

    def _patch(self, steps: torch.Tensor) -> torch.Tensor:
        """Return (window, token, patch step x feature) from (window, step, feature)."""
        return steps.reshape(len(steps), -1, self.patch_steps * steps.shape[2])

    def _unpatch(self, patches: torch.Tensor) -> torch.Tensor:
        """Return (window, step, state) from (window, token, patch step x state)."""
        return patches.reshape(len(patches), -1, len(self.spec.outputs))
