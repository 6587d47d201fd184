from dataclasses import replace

import pytest
import torch
from torch import nn

from odisar.errors import OdisarError
from odisar.fitting import FitBudget, Lesson, fit_network, mean_error, seeded

BUDGET = FitBudget(steps=50, batch_size=8, learning_rate=0.1, gradient_clip=1.0, validations=10)


class Numbers:
    """Examples that are numbers about a mean."""

    def __init__(self, mean: float) -> None:
        self._values = mean + torch.linspace(-0.1, 0.1, 21)

    def __len__(self) -> int:
        return len(self._values)

    def gather(self, windows: torch.Tensor, /) -> torch.Tensor:
        return self._values[windows]


class Constant(nn.Module):
    """Says one number, through dropout in training."""

    def __init__(self) -> None:
        super().__init__()
        self.said = nn.Parameter(torch.zeros(()))
        self.dropout = nn.Dropout(0.5)

    def lesson(self, train: float, held_out: float) -> Lesson:
        def loss(batch: torch.Tensor) -> torch.Tensor:
            return ((self.dropout(torch.ones_like(batch)) * self.said - batch) ** 2).mean()

        return Lesson("constant", loss, Numbers(train), Numbers(held_out))


def said_after(seed: int, noise: str = "noise") -> float:
    network = Constant()
    fit_network(network, replace(network.lesson(1.0, 1.0), noise=noise), BUDGET, seed)
    return network.said.item()


@pytest.mark.parametrize(
    "field", ["steps", "batch_size", "learning_rate", "gradient_clip", "validations"]
)
def test_a_budget_of_nothing_is_refused(field):
    with pytest.raises(OdisarError, match=f"{field}=0"):
        replace(BUDGET, **{field: 0})


def test_more_validations_than_steps_are_refused():
    with pytest.raises(OdisarError, match="validations=10 do not fit into steps=9"):
        replace(BUDGET, steps=9)


@pytest.mark.parametrize(("steps", "validations"), [(10, 10), (50, 7), (3, 2), (1, 1)])
def test_the_last_step_is_validated_and_the_others_evenly(steps, validations):
    at = replace(BUDGET, steps=steps, validations=validations).validated_steps
    assert len(at) == validations
    assert at[-1] == steps
    distances = [b - a for a, b in zip([0, *at], at, strict=False)]
    assert max(distances) - min(distances) <= 1


@pytest.mark.parametrize(("share", "steps", "validations"), [(0.5, 25, 5), (0.12, 6, 1), (0, 1, 1)])
def test_a_part_of_a_budget_has_its_share_of_steps_and_validations(share, steps, validations):
    part = BUDGET.part(share)
    assert part == replace(BUDGET, steps=steps, validations=validations)


def test_a_fit_follows_from_its_seed_and_the_name_of_its_noise():
    assert said_after(3) == said_after(3)
    assert said_after(3) != said_after(4)
    assert said_after(3) != said_after(3, "dropout")


def test_a_fit_runs_on_one_thread_and_leaves_torch_as_it_was():
    threads, state = torch.get_num_threads(), torch.get_rng_state()
    network, seen = Constant(), []
    lesson = network.lesson(1.0, 1.0)

    def loss(batch: torch.Tensor) -> torch.Tensor:
        seen.append(torch.get_num_threads())
        return lesson.loss(batch)

    fit_network(network, replace(lesson, loss=loss), BUDGET, 3)
    assert set(seen) == {1}
    assert torch.get_num_threads() == threads
    assert torch.equal(torch.get_rng_state(), state)


def test_the_weights_of_the_lowest_validation_error_are_kept():
    network = Constant()
    lesson = network.lesson(train=2.0, held_out=0.5)
    record = fit_network(network, lesson, BUDGET, 3)
    errors = record.validation_errors
    assert list(errors) == BUDGET.validated_steps
    assert not network.training
    assert errors[record.best_step] == min(errors.values()) < 0.5 * errors[BUDGET.steps]
    kept = mean_error(lesson.loss, lesson.held_out, 21)
    assert kept == pytest.approx(errors[record.best_step], rel=1e-5)
    assert record.cpu_s > 0


def test_the_first_of_equal_validation_errors_is_kept():
    network = Constant()
    lesson = replace(network.lesson(1.0, 1.0), error=lambda batch: 0 * batch.sum())
    record = fit_network(network, lesson, BUDGET, 3)
    assert record.best_step == 5
    stopped = Constant()
    seen = []

    def loss(batch: torch.Tensor) -> torch.Tensor:
        seen.append(stopped.said.item())
        return stopped.lesson(1.0, 1.0).loss(batch)

    fit_network(stopped, replace(lesson, loss=loss), BUDGET, 3)
    # The weights before the sixth step are those after the fifth.
    assert network.said.item() == seen[5]


def test_an_error_of_its_own_judges_in_batches_of_its_own():
    sizes = []

    def error(batch: torch.Tensor) -> torch.Tensor:
        sizes.append(len(batch))
        return batch.mean()

    lesson = replace(Constant().lesson(1.0, 1.0), error=error, held_out_batch=20)
    record = fit_network(nn.Linear(1, 1), replace(lesson, loss=with_gradient), BUDGET, 3)
    assert sizes == [20, 1] * BUDGET.validations
    assert list(record.validation_errors.values()) == pytest.approx([1.0] * BUDGET.validations)


def with_gradient(batch: torch.Tensor) -> torch.Tensor:
    return batch.clone().requires_grad_().mean()


def test_parameters_that_ask_for_no_gradient_stay():
    network = nn.Sequential(nn.Linear(1, 1), nn.Linear(1, 1)).requires_grad_(requires_grad=False)
    network[1].requires_grad_(requires_grad=True)
    before = [parameter.clone() for parameter in network.parameters()]

    def loss(batch: torch.Tensor) -> torch.Tensor:
        return ((network(batch[:, None]) - 5) ** 2).mean()

    fit_network(network, Lesson("half", loss, Numbers(1.0), Numbers(1.0)), BUDGET, 3)
    same = [torch.equal(a, b) for a, b in zip(before, network.parameters(), strict=True)]
    assert same == [True, True, False, False]


def test_a_fit_that_diverges_names_the_step_and_the_rate():
    network = Constant()
    lesson = network.lesson(train=float("nan"), held_out=1.0)
    told = r"constant: the validation error is nan after step 5:.*lower learning_rate=0\.1"
    with pytest.raises(OdisarError, match=told):
        fit_network(network, lesson, BUDGET, 3)


def test_a_mean_error_weighs_every_example_alike():
    assert mean_error(torch.mean, Numbers(3.0), 20) == pytest.approx(3.0)


def test_named_seeds_differ_by_name_and_by_seed():
    drawn = []
    for seed, name in ((1, "weights"), (1, "weights"), (1, "noise"), (2, "weights")):
        with seeded(seed, name):
            drawn.append(torch.rand(2).tolist())
    assert drawn[0] == drawn[1]
    assert len({tuple(item) for item in drawn}) == 3
