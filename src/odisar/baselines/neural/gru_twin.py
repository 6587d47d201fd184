"""The paper's twin with a recurrent network in the Transformer's place."""

import torch
import torch.nn.functional as F
from torch import nn

from odisar.baselines.interface import Reference
from odisar.baselines.neural.layers import ContextReader, HorizonHead, HorizonOutput
from odisar.baselines.neural.learning import fitted_network, reference_windows
from odisar.baselines.neural.scoring import ContextWindows, WindowDetector, root_mean_square
from odisar.fitting import FitBudget
from odisar.seeding import derive_seed
from odisar.windows.windowing import Batch, WindowSpec

_WIDTH = 64
_HIDDEN = 128


class GruTwin(nn.Module):
    """A GRU over the context; a linear forecast head and a reconstruction MLP on its last state."""

    def __init__(self, spec: WindowSpec, features: int) -> None:
        super().__init__()
        self.reader = ContextReader("gru", features, _WIDTH)
        self.forecast_head = HorizonHead(_WIDTH, spec)
        self.reconstruction_head = HorizonHead(_WIDTH, spec, _HIDDEN)

    def forward(self, context: torch.Tensor) -> HorizonOutput:
        """Return forecast and reconstruction of context (window, step, feature), scaled."""
        state = self.reader(context)
        return HorizonOutput(self.forecast_head(state), self.reconstruction_head(state))

    def loss(self, batch: Batch) -> torch.Tensor:
        """Return L_forecast + L_recon, the latter attached to the forecast as in the paper."""
        output: HorizonOutput = self(batch.context)
        forecast_loss = F.mse_loss(output.forecast, batch.truth)
        return forecast_loss + F.mse_loss(output.reconstruction, output.forecast)


class GruReconstruction(WindowDetector):
    """RMS over steps and states of reconstruction - forecast, scaled: the paper's score."""

    def __init__(self, budget: FitBudget, *, stride_steps: int = 1) -> None:
        super().__init__(stride_steps)
        self._budget = budget

    def _learn(self, reference: Reference, _windows: ContextWindows) -> None:
        """Fit both heads jointly."""
        self._network = fit_gru_twin(reference, self._budget)

    def _of_contexts(self, contexts: torch.Tensor) -> torch.Tensor:
        output: HorizonOutput = self._network(contexts)
        return root_mean_square(output.reconstruction - output.forecast)


def fit_gru_twin(reference: Reference, budget: FitBudget) -> GruTwin:
    """Return a twin whose weights follow from the reference and its seed."""
    windows = reference_windows(reference)
    return fitted_network(
        "GRU twin",
        lambda: GruTwin(reference.spec, windows[0].samples.shape[1]),
        GruTwin.loss,
        windows,
        budget,
        derive_seed(reference.seed, "gru-twin"),
    )
