"""Detectors whose score at t is a function of the context that ends at t, and of nothing else."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from odisar.baselines.interface import Reference, at_samples, context_positions
from odisar.errors import OdisarError
from odisar.recordings.schema import Recording
from odisar.windows.coordinates import features
from odisar.windows.scaling import Scaler
from odisar.windows.windowing import WindowSpec

FloatArray = NDArray[np.float64]

#: Scores are above zero so that their logarithm exists; nothing that happens is so small.
SMALLEST_SCORE = 1e-12

# Neighbouring contexts share nearly all their samples: more of them cost time and tell little.
_MOST_TRAIN_CONTEXTS = 5_000

# Contexts taken out of a recording at a time: about 10 MB at 60 steps of 7 features.
_CONTEXTS_AT_ONCE = 2_048


class ContextDetector(ABC):
    """Fits contexts of the training recordings, then scores every context of other recordings."""

    def __init__(self) -> None:
        self._seen_as: tuple[WindowSpec, Scaler] | None = None

    def fit(self, reference: Reference) -> None:
        """Learn from at most 5,000 contexts, evenly spread over the training recordings."""
        self._fit_contexts(
            _train_contexts(reference.train, reference.spec, reference.scaler), reference.seed
        )
        self._seen_as = reference.spec, reference.scaler

    def score(self, recordings: Sequence[Recording]) -> list[FloatArray]:
        """Return for each recording (sample,) scores, NaN before the first whole context.

        Raises OdisarError if nothing was fitted.
        """
        if self._seen_as is None:
            raise OdisarError(
                f"{type(self).__name__} knows no normal yet; call fit() before score()"
            )
        spec, scaler = self._seen_as
        return [self._score_recording(recording, spec, scaler) for recording in recordings]

    def _score_recording(
        self, recording: Recording, spec: WindowSpec, scaler: Scaler
    ) -> FloatArray:
        positions = context_positions(recording, spec)
        parts = [
            self._score_contexts(contexts)
            for contexts in _contexts(recording, spec, scaler, positions)
        ]
        scores = np.maximum(np.concatenate([np.empty(0), *parts]), SMALLEST_SCORE)
        return at_samples(scores, positions, len(recording.time_s))

    @abstractmethod
    def _fit_contexts(self, contexts: FloatArray, seed: int) -> None:
        """Learn from (context, step, feature) scaled samples."""

    @abstractmethod
    def _score_contexts(self, contexts: FloatArray) -> FloatArray:
        """Return (context,) scores, each from its own (step, feature) scaled samples alone."""


def _train_contexts(
    recordings: Sequence[Recording], spec: WindowSpec, scaler: Scaler
) -> FloatArray:
    """Return (context, step, feature), every n-th of all recordings, n as small as the limit lets.

    Raises OdisarError if no recording is as long as a context.
    """
    positions = [context_positions(recording, spec) for recording in recordings]
    total = sum(len(at) for at in positions)
    if not total:
        raise OdisarError(
            f"no training recording holds a context of {spec.context_steps} steps without a gap; "
            "shorten window.context_steps or add longer recordings"
        )
    stride = -(-total // _MOST_TRAIN_CONTEXTS)
    passed = 0
    parts: list[FloatArray] = []
    for recording, at in zip(recordings, positions, strict=True):
        chosen = at[-passed % stride :: stride]
        parts.extend(_contexts(recording, spec, scaler, chosen))
        passed += len(at)
    return np.concatenate(parts)


def _contexts(
    recording: Recording, spec: WindowSpec, scaler: Scaler, positions: NDArray[np.int64]
) -> Iterator[FloatArray]:
    """Yield (context, step, feature) scaled contexts that end at positions, some at a time."""
    samples = scaler.scale(features(recording, spec.pose)).astype(np.float64)
    steps = np.arange(1 - spec.context_steps, 1)
    for start in range(0, len(positions), _CONTEXTS_AT_ONCE):
        yield samples[positions[start : start + _CONTEXTS_AT_ONCE, None] + steps]
