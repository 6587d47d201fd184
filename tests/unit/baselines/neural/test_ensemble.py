import numpy as np
import torch
from torch import nn

from odisar.baselines.interface import context_positions
from odisar.baselines.neural.ensemble import EnsembleReconstruction, EnsembleVariance, fit_members
from odisar.baselines.neural.layers import HorizonOutput
from odisar.baselines.neural.learning import SharedFit
from small_reference import system_reference

REFERENCE = system_reference()


class Says(nn.Module):
    """Forecasts one number everywhere, and reconstructs it with an offset."""

    def __init__(self, number: float, offset: float) -> None:
        super().__init__()
        self._number, self._offset = number, offset

    def forward(self, context: torch.Tensor) -> HorizonOutput:
        forecast = torch.full((len(context), 10, 2), self._number)
        return HorizonOutput(forecast, forecast + self._offset)


def score_of(kind, *members: nn.Module) -> np.ndarray:
    detector = kind(SharedFit(lambda _: list(members)))
    detector.fit(REFERENCE)
    recording = REFERENCE.held_out[0]
    return detector.score([recording])[0][context_positions(recording, REFERENCE.spec)]


def test_the_variance_is_the_populations():
    scores = score_of(EnsembleVariance, Says(1.0, 0.0), Says(2.0, 0.0), Says(6.0, 0.0))
    np.testing.assert_allclose(scores, np.var([1.0, 2.0, 6.0]))


def test_the_reconstruction_score_is_the_members_mean():
    scores = score_of(EnsembleReconstruction, Says(1.0, 0.5), Says(9.0, -1.5))
    np.testing.assert_allclose(scores, 1.0)


def test_members_differ_in_their_seed_alone():
    seen = []
    fit_members(lambda reference: seen.append(reference) or nn.Identity(), 3, REFERENCE)
    assert len({reference.seed for reference in seen}) == 3
    assert all(reference.train is REFERENCE.train for reference in seen)
    again = []
    fit_members(lambda reference: again.append(reference) or nn.Identity(), 3, REFERENCE)
    assert [item.seed for item in seen] == [item.seed for item in again]
