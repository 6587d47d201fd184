"""A published forecaster: PatchTSMixer (Ekambaram et al. 2023, KDD), from Hugging Face.

The library's own backbone, fitted from random weights; nothing is downloaded. Two things differ
from its stock forecasting head. Targets need not be input channels (the displacement of a relative
pose is none) and commands may be known ahead, so one linear layer maps all channels' patches and
the known commands to all steps and states. And the window's own mean and spread stay in
(``scaling=None``): features are standardised already, and how fast a ferry answers its rudder
depends on how fast it goes, which standardising every window would hide.
"""

import importlib
from dataclasses import dataclass
from typing import Any

import torch
from torch import nn

from odisar.errors import OdisarError
from odisar.fitting import FitBudget
from odisar.forecasters.interface import WindowShape
from odisar.forecasters.network_forecaster import NetworkForecaster

_LIBRARY = "transformers"


@dataclass(frozen=True)
class MixerSize:
    """Steps a patch, width of its embedding, mixer layers, and dropout in them."""

    patch_steps: int
    model_dim: int
    layers: int
    dropout: float


class MixerNetwork(nn.Module):
    """PatchTSMixer that mixes channels as well as patches, and a linear head.

    Raises OdisarError where the library isn't installed or a patch is as long as the context.
    """

    def __init__(self, size: MixerSize, shape: WindowShape) -> None:
        super().__init__()
        if size.patch_steps >= shape.context_steps:
            raise OdisarError(
                f"patch_steps={size.patch_steps} must be below the context of "
                f"{shape.context_steps} steps: the mixer mixes patches"
            )
        library = _library()
        config = library.PatchTSMixerConfig(
            context_length=shape.context_steps,
            patch_length=size.patch_steps,
            patch_stride=size.patch_steps,
            num_input_channels=shape.features,
            d_model=size.model_dim,
            num_layers=size.layers,
            dropout=size.dropout,
            mode="mix_channel",
            scaling=None,
        )
        self.shape = shape
        self.mixer = library.PatchTSMixerModel(config)
        known = shape.horizon_steps * shape.commands
        mixed = shape.features * config.num_patches * size.model_dim
        self.head = nn.Linear(mixed + known, shape.horizon_steps * shape.states)

    def forward(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:
        """Return (window, horizon step, state), scaled."""
        mixed = self.mixer(context).last_hidden_state
        flat: torch.Tensor = self.head(
            torch.cat([mixed.flatten(1), known_future.flatten(1)], dim=1)
        )
        return flat.view(-1, self.shape.horizon_steps, self.shape.states)


class MixerForecaster(NetworkForecaster):
    """PatchTSMixer fitted to the squared error of the horizon."""

    def __init__(self, size: MixerSize, budget: FitBudget, seed: int) -> None:
        super().__init__(budget, seed)
        self._size = size

    def build(self, shape: WindowShape) -> nn.Module:
        """Return a fresh network."""
        return MixerNetwork(self._size, shape)


def _library() -> Any:
    # Loaded when asked for: it takes seconds and is in the optional group of dependencies.
    try:
        return importlib.import_module(_LIBRARY)
    except ModuleNotFoundError as missing:
        raise OdisarError(
            f"the published forecaster needs the package {_LIBRARY!r}, which is not installed; "
            "say make study-setup, or leave this forecaster out"
        ) from missing
