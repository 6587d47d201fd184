"""Score the contexts of recordings: window by window, each from nothing but its own context."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from odisar.baselines.interface import Reference
from odisar.errors import OdisarError
from odisar.fitting import one_thread
from odisar.recordings.schema import Recording
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import scaled_features
from odisar.windows.windowing import WindowSpec

FloatArray = NDArray[np.float64]

#: Values (window, ...) of contexts (window, step, feature), scaled.
OfContexts = Callable[[torch.Tensor], torch.Tensor]

# Contexts that go through a network at once; a matter of memory and speed, not of results.
_CONTEXTS_AT_ONCE = 512
# Scores are compared as multiples of a threshold, so none may be zero.
_SMALLEST_SCORE = 1e-12


@dataclass(frozen=True)
class ContextWindows:
    """Which windows are scored: every ``stride_steps`` from a segment's first whole context on.

    Between two windows the last score holds, so what is said at t was known at t or before.
    """

    spec: WindowSpec
    scaler: Scaler
    stride_steps: int

    @classmethod
    def of(cls, reference: Reference, stride_steps: int) -> "ContextWindows":
        """Return the windows as the reference has them."""
        return cls(reference.spec, reference.scaler, stride_steps)

    def values(self, recording: Recording, of_contexts: OfContexts) -> list[FloatArray]:
        """Return (window, ...) values of the contexts of each of ``segments``, in order of time."""
        samples = scaled_features([recording], self.scaler, self.spec)
        with one_thread(), torch.inference_mode():
            return [
                _in_batches(self._contexts(samples, segment), of_contexts)
                for segment in self.segments(recording)
            ]

    def segments(self, recording: Recording) -> list[tuple[int, int]]:
        """Return the segments that are as long as a context."""
        return [
            segment
            for segment in recording.segments
            if self.spec.issue_positions(segment, 1, horizon_steps=0).size
        ]

    def _contexts(self, samples: torch.Tensor, segment: tuple[int, int]) -> torch.Tensor:
        """Return (window, step, feature), a view of the samples."""
        start, stop = segment[0] + self.spec.unusable_steps, segment[1]
        windows = samples[start:stop].unfold(0, self.spec.context_steps, self.stride_steps)
        return windows.transpose(1, 2)


class WindowDetector(ABC):
    """A detector whose score at t is made of the contexts that end at t or shortly before."""

    def __init__(self, stride_steps: int) -> None:
        self._stride_steps = stride_steps
        self._windows: ContextWindows | None = None

    def fit(self, reference: Reference) -> None:
        """Learn what is normal from the reference's windows."""
        windows = ContextWindows.of(reference, self._stride_steps)
        self._learn(reference, windows)
        self._windows = windows

    def score(self, recordings: Sequence[Recording]) -> list[FloatArray]:
        """Return for each recording (sample,) scores, NaN before the first whole context.

        Raises OdisarError if nothing was fitted.
        """
        if self._windows is None:
            raise NotFittedError(type(self))
        return [self._score(recording, self._windows) for recording in recordings]

    @abstractmethod
    def _learn(self, reference: Reference, windows: ContextWindows) -> None:
        """Fit on the reference; ``windows`` are those that will be scored."""

    @abstractmethod
    def _of_contexts(self, contexts: torch.Tensor) -> torch.Tensor:
        """Return (window, ...) values of contexts (window, step, feature), each from its own."""

    def _of_segment(self, values: FloatArray) -> FloatArray:
        """Return (window,) scores from a segment's values (window, ...), in order of time."""
        return values

    def _score(self, recording: Recording, windows: ContextWindows) -> FloatArray:
        scores = np.full(len(recording.time_s), np.nan)
        by_segment = windows.values(recording, self._of_contexts)
        for segment, values in zip(windows.segments(recording), by_segment, strict=True):
            positions = windows.spec.issue_positions(segment, 1, horizon_steps=0)
            held = np.repeat(self._of_segment(values), self._stride_steps)[: len(positions)]
            scores[positions] = np.maximum(held, _SMALLEST_SCORE)
        return scores


class NotFittedError(OdisarError):
    """A detector was asked before it had learnt anything."""

    def __init__(self, detector: type) -> None:
        super().__init__(f"{detector.__name__} knows no normal yet; call fit() before score()")


def root_mean_square(error: torch.Tensor) -> torch.Tensor:
    """Return (window,) root mean square of errors (window, ...)."""
    return error.flatten(1).square().mean(dim=1).sqrt()


def _in_batches(contexts: torch.Tensor, of_contexts: OfContexts) -> NDArray[Any]:
    parts = [of_contexts(part.contiguous()) for part in torch.split(contexts, _CONTEXTS_AT_ONCE)]
    return torch.cat(parts).numpy().astype(np.float64)
