"""What every forecaster that can be compared here has in common: fit on windows, then forecast."""

import time
from dataclasses import dataclass
from typing import Protocol

import torch

from odisar.errors import OdisarError
from odisar.windows.window_set import WindowSet


class Forecaster(Protocol):
    """Says what the states of the horizon will be, from the context and the known future alone."""

    def fit(self, train: WindowSet, validation: WindowSet) -> None:
        """Learn from ``train``; ``validation`` decides when to stop and what to keep."""
        ...

    def forecast(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:
        """Return (window, horizon step, state) scaled targets (see ``windows.targets``).

        ``context`` is (window, context step, feature), ``known_future`` (window, horizon step,
        command), without commands unless the fitted windows declare them known ahead.
        """
        ...


@dataclass(frozen=True)
class WindowShape:
    """Sizes of the windows a forecaster is fitted to."""

    context_steps: int
    horizon_steps: int
    features: int
    commands: int
    states: int

    @classmethod
    def of(cls, windows: WindowSet) -> "WindowShape":
        """Return the sizes of these windows; ``commands`` are those known ahead."""
        spec = windows.spec
        return cls(
            spec.context_steps,
            spec.horizon_steps,
            windows.samples.shape[1],
            len(spec.known_ahead),
            len(spec.outputs),
        )


def check_windows(train: WindowSet, validation: WindowSet) -> None:
    """Raise OdisarError where there is nothing to fit on, or nothing to choose by."""
    for title, windows in (("training", train), ("validation", validation)):
        if not len(windows):
            spec = windows.spec
            raise OdisarError(
                f"no {title} recording holds a window of {spec.context_steps} + "
                f"{spec.horizon_steps} steps, so no forecaster can be fitted; record longer, or "
                "shorten the case's window"
            )


def fit_timed(forecaster: Forecaster, train: WindowSet, validation: WindowSet) -> float:
    """Fit and return the CPU seconds this process spent on it, over all its threads."""
    before_s = time.process_time()
    forecaster.fit(train, validation)
    return time.process_time() - before_s
