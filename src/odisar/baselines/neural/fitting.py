"""One small training loop for every neural detector: seeded, on one thread, best weights kept."""

import copy
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Generic, Protocol, TypeVar

import torch
from torch import nn
from tqdm import tqdm

from odisar.baselines.interface import Reference
from odisar.errors import OdisarError
from odisar.seeding import derive_seed
from odisar.windows.window_set import WindowSet

BatchT = TypeVar("BatchT")
BatchT_co = TypeVar("BatchT_co", covariant=True)
T = TypeVar("T")
NetworkT = TypeVar("NetworkT", bound=nn.Module)

#: Norm to which a step's gradient is cut: one freak batch must not undo the steps before it.
_GRADIENT_CLIP = 1.0
# Held-out windows lie a third of a context apart: nearer ones say the same again.
_HELD_OUT_PER_CONTEXT = 3


@dataclass(frozen=True)
class FitBudget:
    """What a fit may spend: ``steps`` of ``batch`` windows, looked at ``validations`` times.

    Raises OdisarError where one of them is not above zero, or there are fewer steps than
    validations.
    """

    steps: int
    batch: int
    learning_rate: float
    validations: int

    def __post_init__(self) -> None:
        for name in ("steps", "batch", "learning_rate", "validations"):
            if getattr(self, name) <= 0:
                raise OdisarError(f"{name}={getattr(self, name)} must be above zero; raise it")
        if self.steps < self.validations:
            raise OdisarError(
                f"validations={self.validations} do not fit into steps={self.steps}; "
                "lower validations or raise steps"
            )

    def part(self, share: float) -> "FitBudget":
        """Return a budget of a share of the steps and of the validations, one of each at least."""
        steps, validations = (max(1, round(share * n)) for n in (self.steps, self.validations))
        return replace(self, steps=steps, validations=validations)

    def is_validated(self, step: int) -> bool:
        """Whether the weights are looked at after this step, counted from 1; the last one is."""
        return step * self.validations // self.steps > (step - 1) * self.validations // self.steps


class Examples(Protocol[BatchT_co]):
    """What batches are drawn from, such as a ``WindowSet``."""

    def __len__(self) -> int: ...

    def gather(self, windows: torch.Tensor, /) -> BatchT_co:
        """Return the examples at these positions."""
        ...


@dataclass(frozen=True)
class Lesson(Generic[BatchT]):
    """What a network learns: a scalar ``loss`` of batches of ``train``, judged on ``held_out``."""

    name: str
    loss: Callable[[BatchT], torch.Tensor]
    train: Examples[BatchT]
    held_out: Examples[BatchT]


def fit_network(
    network: nn.Module, lesson: Lesson[BatchT], budget: FitBudget, seed: int
) -> list[float]:
    """Train a network in place and return its validation losses, in order of time.

    Adam (Kingma and Ba, ICLR 2015) moves the parameters that ask for a gradient, at a rate that
    falls to zero along half a cosine. The network ends in evaluation mode with the weights of the
    lowest validation loss. Batches and dropout follow from ``seed``; torch's own random state is
    left as it was.

    Raises OdisarError where no validation loss is finite.
    """
    moved = [parameter for parameter in network.parameters() if parameter.requires_grad]
    optimiser = torch.optim.Adam(moved, lr=budget.learning_rate)
    schedule = torch.optim.lr_scheduler.LambdaLR(
        optimiser, lambda step: 0.5 + 0.5 * math.cos(math.pi * step / budget.steps)
    )
    losses: list[float] = []
    lowest, best = math.inf, network.state_dict()
    with one_thread(), _seeded(derive_seed(seed, "dropout")):
        for step, batch in enumerate(_batches(lesson, budget, seed), start=1):
            network.train()
            optimiser.zero_grad(set_to_none=True)
            lesson.loss(batch).backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(moved, _GRADIENT_CLIP)
            optimiser.step()
            schedule.step()
            if budget.is_validated(step):
                losses.append(_validation_loss(network, lesson, budget.batch))
                if losses[-1] < lowest:
                    lowest, best = losses[-1], copy.deepcopy(network.state_dict())
    if not math.isfinite(lowest):
        raise OdisarError(
            f"{lesson.name}: no validation loss is finite; lower learning_rate="
            f"{budget.learning_rate} or look for values that are not finite"
        )
    network.load_state_dict(best)
    network.eval()
    return losses


def build_network(build: Callable[[], NetworkT], seed: int) -> NetworkT:
    """Return a network whose first weights follow from the seed alone."""
    with _seeded(derive_seed(seed, "weights")):
        return build()


def reference_windows(reference: Reference) -> tuple[WindowSet, WindowSet]:
    """Return the training windows and some of the held-out ones, each with a whole horizon.

    Raises OdisarError where one of them is empty.
    """
    spec = reference.spec
    stride = max(1, spec.context_steps // _HELD_OUT_PER_CONTEXT)
    train = WindowSet(reference.train, reference.scaler, spec)
    held_out = WindowSet(reference.held_out, reference.scaler, spec, stride_steps=stride)
    for name, windows in (("train", train), ("held_out", held_out)):
        if not len(windows):
            raise OdisarError(
                f"no recording in {name} is long enough for a window of {spec.context_steps} + "
                f"{spec.horizon_steps} steps; give longer recordings or shorten the window"
            )
    return train, held_out


class SharedFit(Generic[T]):
    """A fit that several detectors stand on, made once for a reference."""

    def __init__(self, fit: Callable[[Reference], T]) -> None:
        self._fit = fit
        self._made: tuple[Reference, T] | None = None

    def of(self, reference: Reference) -> T:
        """Return what was fitted on this very reference, fitting it if that is new."""
        if self._made is None or self._made[0] is not reference:
            self._made = (reference, self._fit(reference))
        return self._made[1]


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep torch to one thread: processes, not threads, fill the cores; sums keep their order."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@contextmanager
def _seeded(seed: int) -> Iterator[None]:
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        yield


def _batches(lesson: Lesson[BatchT], budget: FitBudget, seed: int) -> Iterator[BatchT]:
    random = torch.Generator().manual_seed(derive_seed(seed, "batches"))
    steps: tqdm[Any] = tqdm(
        range(budget.steps), desc=lesson.name, unit="step", disable=not sys.stderr.isatty()
    )
    for _ in steps:
        yield lesson.train.gather(
            torch.randint(len(lesson.train), (budget.batch,), generator=random)
        )


@torch.no_grad()
def _validation_loss(network: nn.Module, lesson: Lesson[BatchT], batch: int) -> float:
    """Return the mean over all held-out windows, in order, in batches as large as in training."""
    network.eval()
    total = 0.0
    for chosen in torch.split(torch.arange(len(lesson.held_out)), batch):
        total += float(lesson.loss(lesson.held_out.gather(chosen))) * len(chosen)
    return total / len(lesson.held_out)
