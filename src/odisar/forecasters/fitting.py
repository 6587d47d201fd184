"""The one loop that fits every forecasting network here: same batches, same budget, seeded."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import nn

from odisar.errors import OdisarError
from odisar.forecasters.interface import WindowShape, check_windows
from odisar.forecasters.moments import batches
from odisar.seeding import derive_seed
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import Batch

#: From a network in training and a batch to the loss that is minimised.
Objective = Callable[[nn.Module, Batch], torch.Tensor]


@dataclass(frozen=True)
class FittingPlan:
    """A budget and how it is spent: Adam with a cosine decay (Loshchilov and Hutter 2017, ICLR).

    ``steps`` batches of ``batch_size`` windows drawn by ``seed``; the validation error is taken
    ``validations`` times, evenly spaced, the last time after the last step.
    """

    steps: int
    batch_size: int
    learning_rate: float
    gradient_clip: float
    validations: int
    seed: int


@dataclass(frozen=True)
class FittingRecord:
    """How a fit went.

    ``validation_mse`` by step, scaled; ``best_step`` whose weights were kept; ``cpu_s`` CPU
    seconds of this process.
    """

    validation_mse: dict[int, float]
    best_step: int
    cpu_s: float


def mean_squared_error(network: nn.Module, batch: Batch) -> torch.Tensor:
    """Return the mean over windows, steps and states, as the twin's forecast loss."""
    return F.mse_loss(network(batch.context, batch.known_future), batch.truth)


def fit_network(
    network: nn.Module,
    objective: Objective,
    train: WindowSet,
    validation: WindowSet,
    plan: FittingPlan,
) -> FittingRecord:
    """Fit ``network`` in place, on one thread, and leave it with its best validation weights.

    Raises OdisarError where the loss is no longer a number.
    """
    started_s = time.process_time()
    optimiser = torch.optim.Adam(network.parameters(), lr=plan.learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, plan.steps)
    judged = _judged_steps(plan)
    errors: dict[int, float] = {}
    best = _copy(network)
    with one_thread(), seeded(plan.seed, "noise"):
        for step, batch in enumerate(_drawn(train, plan), start=1):
            network.train()
            optimiser.zero_grad()
            loss = objective(network, batch)
            loss.backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(network.parameters(), plan.gradient_clip)
            optimiser.step()
            schedule.step()
            if step in judged:
                errors[step] = validation_error(network, validation)
                _check_finite(errors[step], step, plan)
                if errors[step] == min(errors.values()):
                    best = _copy(network)
    network.load_state_dict(best)
    network.eval()
    best_step = min(errors, key=lambda step: errors[step])
    return FittingRecord(errors, best_step, time.process_time() - started_s)


def validation_error(network: nn.Module, windows: WindowSet) -> float:
    """Return the mean squared error over all windows, steps and states, scaled."""
    network.eval()
    total = 0.0
    with torch.no_grad():
        for batch in batches(windows):
            total += float(mean_squared_error(network, batch)) * len(batch.truth)
    return total / len(windows)


class NetworkForecaster:
    """A forecaster whose network is fitted by ``fit_network``; kinds of it say which network."""

    def __init__(self, plan: FittingPlan) -> None:
        self.plan = plan
        self._network: nn.Module | None = None
        self._record: FittingRecord | None = None

    def build(self, shape: WindowShape) -> nn.Module:
        """Return a fresh network; its random numbers are torch's, which ``fit`` has seeded."""
        raise NotImplementedError

    def objective(self, shape: WindowShape) -> Objective:  # noqa: ARG002
        """Return what is minimised: the squared error, unless a kind of network says otherwise."""
        return mean_squared_error

    @property
    def record(self) -> FittingRecord:
        """How the fit went; raises OdisarError before ``fit``."""
        if self._record is None:
            raise OdisarError(f"{type(self).__name__} is not fitted yet; call fit first")
        return self._record

    @property
    def network(self) -> nn.Module:
        """The fitted network; raises OdisarError before ``fit``."""
        if self._network is None:
            raise OdisarError(f"{type(self).__name__} is not fitted yet; call fit first")
        return self._network

    def fit(self, train: WindowSet, validation: WindowSet) -> None:
        """Fit a fresh network: the plan's seed and the windows decide everything."""
        check_windows(train, validation)
        shape = WindowShape.of(train)
        with seeded(self.plan.seed, "weights"):
            network, objective = self.build(shape), self.objective(shape)
        self._record = fit_network(network, objective, train, validation, self.plan)
        self._network = network

    def forecast(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:
        """Return (window, horizon step, state), scaled."""
        with torch.no_grad():
            found: torch.Tensor = self.network(context, known_future)
        return found


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


def _drawn(windows: WindowSet, plan: FittingPlan) -> Iterator[Batch]:
    random = torch.Generator().manual_seed(derive_seed(plan.seed, "batches"))
    for _ in range(plan.steps):
        yield windows.gather(torch.randint(len(windows), (plan.batch_size,), generator=random))


def _judged_steps(plan: FittingPlan) -> set[int]:
    count = min(plan.validations, plan.steps)
    return {round(plan.steps * i / count) for i in range(1, count + 1)}


def _copy(network: nn.Module) -> dict[str, torch.Tensor]:
    return {name: value.clone() for name, value in network.state_dict().items()}


def _check_finite(error: float, step: int, plan: FittingPlan) -> None:
    if not math.isfinite(error):
        raise OdisarError(
            f"the validation error of a forecaster is {error} after step {step}: the fit has "
            f"diverged; lower its learning_rate={plan.learning_rate}"
        )
