"""The design that the paper replaces: a recurrent forecaster, then an autoencoder of forecasts."""

import torch
import torch.nn.functional as F
from torch import nn

from odisar.baselines.interface import Reference
from odisar.baselines.neural.layers import Autoencoder, ContextReader, HorizonHead
from odisar.baselines.neural.learning import fitted_network, reference_windows
from odisar.baselines.neural.scoring import ContextWindows, WindowDetector, root_mean_square
from odisar.fitting import FitBudget
from odisar.seeding import derive_seed
from odisar.windows.windowing import Batch

_WIDTH = 64
_HIDDEN = 128
_BOTTLENECK = 16


class RnnThenAutoencoder(WindowDetector):
    """How badly an autoencoder trained on forecasts reconstructs the forecast issued at t.

    The two-model set-up that the paper names as its predecessor (section "Related Work"): an
    LSTM forecasts the horizon from the context, and an autoencoder learns the forecasts of the
    training windows. The score is the root mean square over steps and states, in scaled units.
    """

    def __init__(self, budget: FitBudget, *, stride_steps: int = 1) -> None:
        super().__init__(stride_steps)
        self._budget = budget

    def _learn(self, reference: Reference, _windows: ContextWindows) -> None:
        """Fit the forecaster to the truth, then the autoencoder to the forecasts."""
        windows = reference_windows(reference)
        seed = derive_seed(reference.seed, "rnn-then-autoencoder")
        spec, features = reference.spec, windows[0].samples.shape[1]
        self._forecaster = fitted_network(
            "LSTM forecaster",
            lambda: nn.Sequential(
                ContextReader("lstm", features, _WIDTH), HorizonHead(_WIDTH, spec)
            ),
            _forecast_loss,
            windows,
            self._budget,
            derive_seed(seed, "forecaster"),
        )
        shape = (spec.horizon_steps, len(spec.outputs))
        self._autoencoder = fitted_network(
            "autoencoder of forecasts",
            lambda: Autoencoder(shape, _HIDDEN, _BOTTLENECK),
            self._reconstruction_loss,
            windows,
            self._budget,
            derive_seed(seed, "autoencoder"),
        )

    def _reconstruction_loss(self, autoencoder: nn.Module, batch: Batch) -> torch.Tensor:
        with torch.no_grad():
            forecast = self._forecaster(batch.context)
        return F.mse_loss(autoencoder(forecast), forecast)

    def _of_contexts(self, contexts: torch.Tensor) -> torch.Tensor:
        forecast = self._forecaster(contexts)
        return root_mean_square(self._autoencoder(forecast) - forecast)


def _forecast_loss(forecaster: nn.Module, batch: Batch) -> torch.Tensor:
    return F.mse_loss(forecaster(batch.context), batch.truth)
