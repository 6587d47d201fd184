"""Monte Carlo variance as a score of its own: how much a twin's dropout draws disagree."""

import torch

from odisar.baselines.interface import Reference
from odisar.baselines.neural.scoring import ContextWindows, WindowDetector
from odisar.errors import OdisarError
from odisar.twin.bundle import TrainedTwin
from odisar.twin.mc_dropout import draw_forecasts

#: Forecasts are drawn so often in a horizon: every one is as many passes as there are draws.
_FORECASTS_PER_HORIZON = 4
#: Windows whose draws are made at once; a matter of memory, not of results.
_BATCH = 64
#: What is usual is at least this: draws that agree on a state must not divide by zero.
_SMALLEST = 1.0e-12


class DropoutVariance(WindowDetector):
    """Population variance over a trained twin's draws, in multiples of what is usual.

    Gal and Ghahramani (2016); the paper's uncertainty. What is usual of each state and step is the
    mean on held-out recordings, so that no state rules by its scale. The twin is the pipeline's;
    one that must know commands ahead can't be asked about a context alone and is refused.
    """

    def __init__(self, twin: TrainedTwin) -> None:
        if twin.spec.known_ahead:
            raise OdisarError(
                "the variance of draws is scored from contexts alone, but this twin must know "
                "commands ahead"
            )
        super().__init__(max(1, twin.spec.horizon_steps // _FORECASTS_PER_HORIZON))
        self._twin = twin
        self._usual: torch.Tensor | None = None

    def _learn(self, reference: Reference, windows: ContextWindows) -> None:
        """Find the usual variance (step, state) on the held-out recordings."""
        parts = [
            torch.from_numpy(values)
            for recording in reference.held_out
            for values in windows.values(recording, self._variances)
        ]
        self._usual = torch.cat(parts).mean(dim=0).clamp(min=_SMALLEST)

    def _of_contexts(self, contexts: torch.Tensor) -> torch.Tensor:
        assert self._usual is not None  # noqa: S101 (score has looked)
        return (self._variances(contexts) / self._usual).mean(dim=(1, 2))

    def _variances(self, contexts: torch.Tensor) -> torch.Tensor:
        """Return (window, step, state) variances over the draws, scaled."""
        parts = []
        for part in torch.split(contexts, _BATCH):
            known = torch.empty(len(part), self._twin.spec.horizon_steps, 0)
            drawn = draw_forecasts(self._twin.network, self._twin.masks, part, known).forecast
            parts.append(drawn.double().var(dim=0, correction=0))
        return torch.cat(parts)
