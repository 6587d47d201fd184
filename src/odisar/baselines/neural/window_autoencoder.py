"""An autoencoder of the context: how unusual the residuals of what has been observed are."""

import numpy as np
import torch
import torch.nn.functional as F

from odisar.baselines.interface import Reference
from odisar.baselines.neural.layers import Autoencoder
from odisar.baselines.neural.learning import fitted_network, reference_windows
from odisar.baselines.neural.scoring import ContextWindows, FloatArray, WindowDetector
from odisar.fitting import FitBudget
from odisar.seeding import derive_seed

_HIDDEN = 128
_BOTTLENECK = 16
# A command that stands still is reconstructed almost exactly; below this its logarithm would say
# how exactly, and nothing else.
_SMALLEST_RESIDUAL = 1e-4
# Share of each residual's own variance added to it: two commands of one value move together.
_RIDGE = 1e-3


class InputReconstruction(WindowDetector):
    """T2 of the logarithms of each feature's mean squared residual over the context.

    Hotelling (Annals of Mathematical Statistics, 1931); mean and covariance are those of the
    held-out windows. Logarithms make residuals of any size nearly normal, so that one threshold
    holds for calm and for lively windows.
    """

    def __init__(self, budget: FitBudget, *, stride_steps: int = 1) -> None:
        super().__init__(stride_steps)
        self._budget = budget

    def _learn(self, reference: Reference, windows: ContextWindows) -> None:
        """Fit the autoencoder on training contexts, the spread on held-out ones."""
        fitted_on = reference_windows(reference)
        shape = (reference.spec.context_steps, fitted_on[0].samples.shape[1])
        self._network = fitted_network(
            "autoencoder of contexts",
            lambda: Autoencoder(shape, _HIDDEN, _BOTTLENECK),
            lambda network, batch: F.mse_loss(network(batch.context), batch.context),
            fitted_on,
            self._budget,
            derive_seed(reference.seed, "input-reconstruction"),
        )
        residuals = np.concatenate(
            [
                values
                for recording in reference.held_out
                for values in windows.values(recording, self._of_contexts)
            ]
        )
        self._mean = residuals.mean(axis=0)
        covariance = np.atleast_2d(np.cov(residuals, rowvar=False))
        self._precision = np.linalg.inv(covariance + _RIDGE * np.diag(np.diag(covariance)))

    def _of_contexts(self, contexts: torch.Tensor) -> torch.Tensor:
        """Return (window, feature) logarithms of the mean squared residual over the steps."""
        residuals: torch.Tensor = self._network(contexts) - contexts
        return (residuals.square().mean(dim=1) + _SMALLEST_RESIDUAL).log()

    def _of_segment(self, values: FloatArray) -> FloatArray:
        centred = values - self._mean
        return np.asarray(np.einsum("wi,ij,wj->w", centred, self._precision, centred))
