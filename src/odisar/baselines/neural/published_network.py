"""The network of the published code, with the properties that decide what its numbers mean."""

from typing import cast

import torch
import torch.nn.functional as F
from torch import nn

from odisar.baselines.neural.layers import HorizonOutput
from odisar.errors import OdisarError
from odisar.windows.windowing import Batch, WindowSpec

_LAYERS = 3
_WIDTH = 64
_HEADS = 4
_FEEDFORWARD = 128
_RECONSTRUCTION = 128
_DROPOUT = 0.1


class PublishedNetwork(nn.Module):
    """An encoder-decoder Transformer that is fed what it should forecast.

    Three properties, none of them the paper's: the decoder reads the true states t+1..t+h, neither
    shifted nor masked; attention runs over the windows of a batch instead of over the steps of a
    window, as torch's layers take the first axis for time unless told otherwise; the forecast is
    detached in the reconstruction loss.

    Raises OdisarError where context and horizon differ in length: step i of the horizon attends to
    step i of the contexts.
    """

    def __init__(self, spec: WindowSpec, features: int) -> None:
        super().__init__()
        if spec.context_steps != spec.horizon_steps:
            raise OdisarError(
                f"the published network pairs each step of the horizon with one of the context, so "
                f"context_steps={spec.context_steps} must equal horizon_steps={spec.horizon_steps};"
                " leave this detector out for the case, or change its window"
            )
        states = len(spec.outputs)
        layer = (_WIDTH, _HEADS, _FEEDFORWARD, _DROPOUT)
        self.embed_context = nn.Linear(features, _WIDTH)
        self.embed_future = nn.Linear(states, _WIDTH)
        self.context_position = nn.Parameter(0.02 * torch.randn(spec.context_steps, _WIDTH))
        self.future_position = nn.Parameter(0.02 * torch.randn(spec.horizon_steps, _WIDTH))
        self.encoder = nn.TransformerEncoder(
            nn.TransformerEncoderLayer(*layer), _LAYERS, enable_nested_tensor=False
        )
        self.decoder = nn.TransformerDecoder(nn.TransformerDecoderLayer(*layer), _LAYERS)
        self.forecast_head = nn.Linear(_WIDTH, states)
        self.reconstruction_head = nn.Sequential(
            nn.Linear(_WIDTH, _RECONSTRUCTION), nn.ReLU(), nn.Linear(_RECONSTRUCTION, states)
        )

    def forward(self, context: torch.Tensor, future: torch.Tensor) -> HorizonOutput:
        """Return "forecast" and reconstruction of a batch, scaled.

        ``context`` is (window, context step, feature) and ``future`` (window, horizon step,
        state): what the decoder is told of the horizon.
        """
        memory = self.encoder(self.embed_context(context) + self.context_position)
        decoded = self.decoder(self.embed_future(future) + self.future_position, memory)
        return HorizonOutput(self.forecast_head(decoded), self.reconstruction_head(decoded))

    def joint_loss(self, batch: Batch) -> torch.Tensor:
        """Return the loss of the first phase; the truth is input and target at once."""
        output: HorizonOutput = self(batch.context, batch.truth)
        return F.mse_loss(output.forecast, batch.truth) + _reconstruction_loss(output)

    def reconstruction_loss(self, batch: Batch) -> torch.Tensor:
        """Return the loss of the second phase."""
        return _reconstruction_loss(cast("HorizonOutput", self(batch.context, batch.truth)))

    def keep_only_reconstruction_trainable(self) -> None:
        """Freeze everything but the reconstruction head, as the second phase does."""
        self.requires_grad_(requires_grad=False)
        self.reconstruction_head.requires_grad_(requires_grad=True)


def _reconstruction_loss(output: HorizonOutput) -> torch.Tensor:
    return F.mse_loss(output.reconstruction, output.forecast.detach())
