"""The one loop that fits small networks: seeded, on one thread, best validation weights kept.

The neural alternatives to the twin and the forecasters of the study stand on it. The twin itself
is trained by Lightning, which can resume.
"""

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Generic, Protocol, TypeVar

import torch
from torch import nn
from tqdm import tqdm

from odisar.errors import OdisarError
from odisar.seeding import derive_seed

BatchT = TypeVar("BatchT")
BatchT_co = TypeVar("BatchT_co", covariant=True)


@dataclass(frozen=True)
class FitBudget:
    """What a fit may spend: ``steps`` of ``batch_size`` examples, validated ``validations`` times.

    ``gradient_clip`` is the norm to which a step's gradient is cut. Raises OdisarError where a
    value is not above zero, or there are fewer steps than validations.
    """

    steps: int
    batch_size: int
    learning_rate: float
    gradient_clip: float
    validations: int

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value <= 0:
                raise OdisarError(f"{name}={value} must be above zero; raise it")
        if self.steps < self.validations:
            raise OdisarError(
                f"validations={self.validations} do not fit into steps={self.steps}; "
                "lower validations or raise steps"
            )

    def part(self, share: float) -> "FitBudget":
        """Return a budget of a share of the steps and of the validations, one of each at least."""
        steps, validations = (max(1, round(share * n)) for n in (self.steps, self.validations))
        return replace(self, steps=steps, validations=validations)

    @property
    def validated_steps(self) -> list[int]:
        """The steps after which the weights are judged, from 1, evenly spaced; the last is one."""
        return [
            math.ceil(self.steps * i / self.validations) for i in range(1, self.validations + 1)
        ]


class Examples(Protocol[BatchT_co]):
    """What batches are drawn from, such as a ``WindowSet``."""

    def __len__(self) -> int: ...

    def gather(self, windows: torch.Tensor, /) -> BatchT_co:
        """Return the examples at these positions."""
        ...


@dataclass(frozen=True)
class Lesson(Generic[BatchT]):
    """What a network learns: a scalar ``loss`` of batches of ``train``, judged on ``held_out``.

    It is judged by ``error`` in batches of ``held_out_batch``, which are the loss and the batch
    size of training unless given. ``noise`` names the seed of whatever the loss draws, such as
    dropout.
    """

    name: str
    loss: Callable[[BatchT], torch.Tensor]
    train: Examples[BatchT]
    held_out: Examples[BatchT]
    error: Callable[[BatchT], torch.Tensor] | None = None
    held_out_batch: int | None = None
    noise: str = "noise"


@dataclass(frozen=True)
class FitRecord:
    """How a fit went.

    ``validation_errors`` by step, ``best_step`` whose weights were kept, ``cpu_s`` CPU seconds of
    this process.
    """

    validation_errors: dict[int, float]
    best_step: int
    cpu_s: float


def fit_network(
    network: nn.Module, lesson: Lesson[BatchT], budget: FitBudget, seed: int
) -> FitRecord:
    """Fit a network in place; it ends in evaluation mode with its best validation weights.

    Adam (Kingma and Ba, ICLR 2015) moves the parameters that ask for a gradient, at a rate that
    falls to zero along half a cosine (Loshchilov and Hutter, ICLR 2017). Batches and noise follow
    from ``seed``; torch's own random state is left as it was.

    Raises OdisarError where a validation error is not finite.
    """
    started_s = time.process_time()
    moved = [parameter for parameter in network.parameters() if parameter.requires_grad]
    optimiser = torch.optim.Adam(moved, lr=budget.learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, budget.steps)
    validated, errors = set(budget.validated_steps), dict[int, float]()
    best_step, best = 0, network.state_dict()
    with one_thread(), seeded(seed, lesson.noise):
        for step, batch in enumerate(_batches(lesson, budget, seed), start=1):
            network.train()
            optimiser.zero_grad()
            lesson.loss(batch).backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(moved, budget.gradient_clip)
            optimiser.step()
            schedule.step()
            if step in validated:
                errors[step] = _validation_error(network, lesson, budget)
                _check_finite(errors[step], step, lesson.name, budget)
                if errors[step] < errors.get(best_step, math.inf):
                    best_step, best = step, _copied_weights(network)
    network.load_state_dict(best)
    network.eval()
    return FitRecord(errors, best_step, time.process_time() - started_s)


def mean_error(
    error: Callable[[BatchT], torch.Tensor], examples: Examples[BatchT], batch_size: int
) -> float:
    """Return the mean of a scalar error over all examples, in order, each weighed alike."""
    total = 0.0
    with torch.no_grad():
        for chosen in torch.split(torch.arange(len(examples)), batch_size):
            total += float(error(examples.gather(chosen))) * len(chosen)
    return total / len(examples)


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep torch to one thread meanwhile: sums in one order, and CPU seconds that compare."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@contextmanager
def seeded(seed: int, name: str) -> Iterator[None]:
    """Give torch's own random numbers a named seed meanwhile, and put them back afterwards."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(derive_seed(seed, name))
        yield


def _batches(lesson: Lesson[BatchT], budget: FitBudget, seed: int) -> Iterator[BatchT]:
    random = torch.Generator().manual_seed(derive_seed(seed, "batches"))
    examples, size = len(lesson.train), (budget.batch_size,)
    steps: tqdm[Any] = tqdm(
        range(budget.steps), desc=lesson.name, unit="step", disable=not sys.stderr.isatty()
    )
    for _ in steps:
        yield lesson.train.gather(torch.randint(examples, size, generator=random))


def _validation_error(network: nn.Module, lesson: Lesson[BatchT], budget: FitBudget) -> float:
    network.eval()
    batch_size = lesson.held_out_batch or budget.batch_size
    return mean_error(lesson.error or lesson.loss, lesson.held_out, batch_size)


def _copied_weights(network: nn.Module) -> dict[str, torch.Tensor]:
    return {name: value.clone() for name, value in network.state_dict().items()}


def _check_finite(error: float, step: int, name: str, budget: FitBudget) -> None:
    if not math.isfinite(error):
        raise OdisarError(
            f"{name}: the validation error is {error} after step {step}: the fit has diverged; "
            f"lower learning_rate={budget.learning_rate}, or look for values that are not finite"
        )
