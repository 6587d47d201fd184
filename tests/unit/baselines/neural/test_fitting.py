from dataclasses import replace

import pytest
import torch
from torch import nn

from odisar.baselines.neural.fitting import (
    FitBudget,
    Lesson,
    SharedFit,
    build_network,
    fit_network,
    reference_windows,
)
from odisar.errors import OdisarError
from small_reference import system_reference
from small_system import make_recording

BUDGET = FitBudget(steps=50, batch=8, learning_rate=0.1, validations=10)


class Numbers:
    """Examples that are numbers about a mean."""

    def __init__(self, mean: float) -> None:
        self._values = mean + torch.linspace(-0.1, 0.1, 21)

    def __len__(self) -> int:
        return len(self._values)

    def gather(self, windows: torch.Tensor, /) -> torch.Tensor:
        return self._values[windows]


class Constant(nn.Module):
    """Says one number, and has one that no loss depends on."""

    def __init__(self) -> None:
        super().__init__()
        self.said = nn.Parameter(torch.zeros(()))
        self.noise = nn.Dropout(0.5)

    def lesson(self, train: float, held_out: float) -> Lesson:
        def loss(batch: torch.Tensor) -> torch.Tensor:
            return ((self.noise(torch.ones_like(batch)) * self.said - batch) ** 2).mean()

        return Lesson("constant", loss, Numbers(train), Numbers(held_out))


def said_after(seed: int, budget: FitBudget = BUDGET) -> float:
    network = Constant()
    fit_network(network, network.lesson(1.0, 1.0), budget, seed)
    return network.said.item()


@pytest.mark.parametrize("field", ["steps", "batch", "learning_rate", "validations"])
def test_a_budget_of_nothing_is_refused(field):
    with pytest.raises(OdisarError, match=f"{field}=0"):
        replace(BUDGET, **{field: 0})


def test_more_validations_than_steps_are_refused():
    with pytest.raises(OdisarError, match="validations=10 do not fit into steps=9"):
        replace(BUDGET, steps=9)


@pytest.mark.parametrize(("steps", "validations"), [(10, 10), (50, 7), (3, 2), (1, 1)])
def test_the_last_step_is_validated_and_the_others_evenly(steps, validations):
    budget = FitBudget(steps, 1, 0.1, validations)
    at = [step for step in range(1, steps + 1) if budget.is_validated(step)]
    assert len(at) == validations
    assert at[-1] == steps
    distances = [b - a for a, b in zip([0, *at], at, strict=False)]
    assert max(distances) - min(distances) <= 1


@pytest.mark.parametrize(("share", "steps", "validations"), [(0.5, 25, 5), (0.12, 6, 1), (0, 1, 1)])
def test_a_part_of_a_budget_has_its_share_of_steps_and_validations(share, steps, validations):
    part = BUDGET.part(share)
    assert part == replace(BUDGET, steps=steps, validations=validations)


def test_a_fit_follows_from_its_seed():
    assert said_after(3) == said_after(3)
    assert said_after(3) != said_after(4)


def test_a_fit_leaves_torch_as_it_was():
    threads, state = torch.get_num_threads(), torch.get_rng_state()
    said_after(3)
    assert torch.get_num_threads() == threads
    assert torch.equal(torch.get_rng_state(), state)


def test_the_weights_of_the_lowest_validation_loss_are_kept():
    network = Constant()
    lesson = network.lesson(train=2.0, held_out=0.5)
    losses = fit_network(network, lesson, BUDGET, 3)
    assert len(losses) == BUDGET.validations
    assert not network.training
    kept = lesson.loss(lesson.held_out.gather(torch.arange(21))).item()
    assert kept == pytest.approx(min(losses), rel=1e-5)
    assert min(losses) < 0.5 * losses[-1]


def test_parameters_that_ask_for_no_gradient_stay():
    network = nn.Sequential(nn.Linear(1, 1), nn.Linear(1, 1)).requires_grad_(requires_grad=False)
    network[1].requires_grad_(requires_grad=True)
    before = [parameter.clone() for parameter in network.parameters()]

    def loss(batch: torch.Tensor) -> torch.Tensor:
        return ((network(batch[:, None]) - 5) ** 2).mean()

    fit_network(network, Lesson("half", loss, Numbers(1.0), Numbers(1.0)), BUDGET, 3)
    same = [torch.equal(a, b) for a, b in zip(before, network.parameters(), strict=True)]
    assert same == [True, True, False, False]


def test_a_fit_that_never_is_finite_says_so():
    network = Constant()
    lesson = network.lesson(train=1.0, held_out=float("nan"))
    with pytest.raises(OdisarError, match=r"lower learning_rate=0\.1"):
        fit_network(network, lesson, BUDGET, 3)


def test_first_weights_follow_from_the_seed():
    first, again, other = (build_network(lambda: nn.Linear(3, 2), seed) for seed in (1, 1, 2))
    assert torch.equal(first.weight, again.weight)
    assert not torch.equal(first.weight, other.weight)


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
