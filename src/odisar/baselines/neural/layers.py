"""Networks that more than one detector is made of."""

from dataclasses import dataclass
from typing import Literal, cast

import torch
from torch import nn

from odisar.windows.windowing import WindowSpec

#: The recurrent cells to choose from.
Cell = Literal["gru", "lstm"]


@dataclass(frozen=True)
class HorizonOutput:
    """``forecast`` and ``reconstruction`` (window, horizon step, state), scaled."""

    forecast: torch.Tensor
    reconstruction: torch.Tensor


class ContextReader(nn.Module):
    """A recurrent network that reads a context and ends in one state.

    GRU: Cho et al., EMNLP 2014; LSTM: Hochreiter and Schmidhuber, Neural Computation 1997.
    """

    def __init__(self, cell: Cell, features: int, width: int) -> None:
        super().__init__()
        kinds: dict[Cell, type[nn.GRU | nn.LSTM]] = {"gru": nn.GRU, "lstm": nn.LSTM}
        self.cell = kinds[cell](features, width, batch_first=True)

    def forward(self, context: torch.Tensor) -> torch.Tensor:
        """Return (window, width) from context (window, step, feature)."""
        return cast("torch.Tensor", self.cell(context)[0][:, -1])


class HorizonHead(nn.Sequential):
    """From one state of a window to all steps of its horizon, by an MLP or a linear map."""

    def __init__(self, width: int, spec: WindowSpec, hidden: int | None = None) -> None:
        shape = (spec.horizon_steps, len(spec.outputs))
        values = shape[0] * shape[1]
        maps = (
            [nn.Linear(width, values)]
            if hidden is None
            else [nn.Linear(width, hidden), nn.ReLU(), nn.Linear(hidden, values)]
        )
        super().__init__(*maps, nn.Unflatten(1, shape))


class Autoencoder(nn.Sequential):
    """Steps of a window through a bottleneck and back, fully connected.

    Maps (window, step, feature) to the same shape.
    """

    def __init__(self, shape: tuple[int, int], hidden: int, bottleneck: int) -> None:
        values = shape[0] * shape[1]
        super().__init__(
            nn.Flatten(),
            nn.Linear(values, hidden),
            nn.ReLU(),
            nn.Linear(hidden, bottleneck),
            nn.Linear(bottleneck, hidden),
            nn.ReLU(),
            nn.Linear(hidden, values),
            nn.Unflatten(1, shape),
        )
