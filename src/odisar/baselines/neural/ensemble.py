"""A deep ensemble: the same twin fitted from several seeds, and what its members disagree on."""

from collections.abc import Callable
from dataclasses import replace

import torch
from torch import nn

from odisar.baselines.interface import Reference
from odisar.baselines.neural.layers import HorizonOutput
from odisar.baselines.neural.learning import SharedFit
from odisar.baselines.neural.scoring import ContextWindows, WindowDetector, root_mean_square
from odisar.seeding import derive_seed

#: Fits a member: a network from contexts (window, step, feature) to a ``HorizonOutput``.
FitMember = Callable[[Reference], nn.Module]


def fit_members(fit_member: FitMember, members: int, reference: Reference) -> list[nn.Module]:
    """Return members that differ in their seed alone.

    Lakshminarayanan, Pritzel and Blundell, NeurIPS 2017: other first weights and other batches
    are enough. Their members also predict a variance, these do not.
    """
    return [
        fit_member(replace(reference, seed=derive_seed(reference.seed, "ensemble", member)))
        for member in range(members)
    ]


class _Ensemble(WindowDetector):
    """What both scores of an ensemble have in common: their members."""

    def __init__(self, members: SharedFit[list[nn.Module]], *, stride_steps: int = 2) -> None:
        super().__init__(stride_steps)
        self._shared = members

    def _learn(self, reference: Reference, _windows: ContextWindows) -> None:
        """Fit the members, or take over those that were fitted on this very reference."""
        self._members = self._shared.of(reference)

    def _outputs(self, contexts: torch.Tensor) -> list[HorizonOutput]:
        return [member(contexts) for member in self._members]


class EnsembleVariance(_Ensemble):
    """Population variance of the members' forecasts, mean over steps and states, scaled."""

    def _of_contexts(self, contexts: torch.Tensor) -> torch.Tensor:
        forecasts = torch.stack([output.forecast for output in self._outputs(contexts)])
        return forecasts.var(dim=0, correction=0).mean(dim=(1, 2))


class EnsembleReconstruction(_Ensemble):
    """Mean over the members of the RMS of reconstruction - forecast, scaled."""

    def _of_contexts(self, contexts: torch.Tensor) -> torch.Tensor:
        errors = [
            root_mean_square(output.reconstruction - output.forecast)
            for output in self._outputs(contexts)
        ]
        return torch.stack(errors).mean(dim=0)
