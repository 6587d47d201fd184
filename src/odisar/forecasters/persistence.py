"""Nothing changes: what every forecast has to beat."""

import numpy as np
import torch

from odisar.forecasters.last_state import LastStates
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import WindowSpec


class Persistence:
    """The last observed state; of a relative pose, no displacement."""

    def __init__(self, scaler: Scaler, spec: WindowSpec) -> None:
        self._last = LastStates.of(scaler, spec)
        self._horizon_steps = spec.horizon_steps

    def fit(self, train: WindowSet, validation: WindowSet) -> None:
        """Nothing is learned."""

    def forecast(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:  # noqa: ARG002
        """Return (window, horizon step, state), scaled; the known future plays no part."""
        states = self._last.states(context[:, -1:]).expand(-1, self._horizon_steps, -1)
        return self._last.assembled(states, np.zeros((*states.shape[:2], 3)))
