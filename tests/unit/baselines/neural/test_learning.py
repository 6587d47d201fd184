from dataclasses import replace

import pytest
import torch
from torch import nn

from odisar.baselines.neural.learning import (
    SharedFit,
    build_network,
    fitted_network,
    reference_windows,
)
from odisar.errors import OdisarError
from small_reference import system_reference
from small_system import make_recording

from .neural_cases import BUDGET


def test_first_weights_follow_from_the_seed():
    first, again, other = (build_network(lambda: nn.Linear(3, 2), seed) for seed in (1, 1, 2))
    assert torch.equal(first.weight, again.weight)
    assert not torch.equal(first.weight, other.weight)


def test_a_fitted_network_has_learnt_its_loss_and_follows_from_the_seed():
    windows = reference_windows(system_reference())

    def loss(network: nn.Linear, batch) -> torch.Tensor:
        return ((network(torch.ones(1, 1)) - 5) ** 2).mean() + 0 * batch.truth.sum()

    def build() -> nn.Linear:
        return nn.Linear(1, 1)

    budget = replace(BUDGET, learning_rate=0.5)
    first, again, other = (
        fitted_network("five", build, loss, windows, budget, seed) for seed in (1, 1, 2)
    )
    assert (first.weight + first.bias).item() == pytest.approx(5, abs=0.5)
    assert torch.equal(first.weight, again.weight)
    assert not torch.equal(first.weight, other.weight)
    assert not first.training


@pytest.mark.parametrize("part", ["train", "held_out"])
def test_a_reference_without_a_whole_window_is_refused(part):
    reference = system_reference()
    steps = reference.spec.context_steps + reference.spec.horizon_steps
    short = [make_recording("short", steps - 1)]
    with pytest.raises(OdisarError, match=f"no recording in {part} is long enough"):
        reference_windows(replace(reference, **{part: short}))


def test_a_shared_fit_is_made_once_for_a_reference():
    fits = []
    shared = SharedFit(lambda reference: fits.append(reference) or len(fits))
    first, second = system_reference(), system_reference()
    assert [shared.of(first), shared.of(first), shared.of(second)] == [1, 1, 2]
