"""What neural detectors learn from: windows of a reference, and networks fitted on them."""

from collections.abc import Callable
from typing import Generic, TypeVar

import torch
from torch import nn

from odisar.baselines.interface import Reference
from odisar.errors import OdisarError
from odisar.fitting import FitBudget, Lesson, fit_network, seeded
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import Batch

T = TypeVar("T")
NetworkT = TypeVar("NetworkT", bound=nn.Module)

#: Training windows, and held-out ones.
ReferenceWindows = tuple[WindowSet, WindowSet]

# Held-out windows lie a third of a context apart: nearer ones say the same again.
_HELD_OUT_PER_CONTEXT = 3


def reference_windows(reference: Reference) -> ReferenceWindows:
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


def build_network(build: Callable[[], NetworkT], seed: int) -> NetworkT:
    """Return a network whose first weights follow from the seed alone."""
    with seeded(seed, "weights"):
        return build()


def fitted_network(
    name: str,
    build: Callable[[], NetworkT],
    loss: Callable[[NetworkT, Batch], torch.Tensor],
    windows: ReferenceWindows,
    budget: FitBudget,
    seed: int,
) -> NetworkT:
    """Return a network fitted to a loss of its own: windows, budget and seed decide its weights."""
    network = build_network(build, seed)
    lesson = Lesson(name, lambda batch: loss(network, batch), *windows)
    fit_network(network, lesson, budget, seed)
    return network


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
