"""The published recipe as its code does it, leaks included: a row beside, never a detector to use.

What was found in the published code, and differs from the paper, is repeated here from a
description of it: see ``published_network`` for the network. Besides, scored windows come w + h
steps apart, those of all recordings in one list that is cut into batches, and a window's score is
the root of the mean squared difference between forecast and reconstruction in scaled units. In a
second phase of training only the reconstruction head is fitted.

Three things aren't repeated. Windows stay inside their recordings (published ones cross from one
file into the next). The number of steps and the learning rate are the budget's: 120 + 100 epochs at
1e-4 would take hours. And the second phase, published for the vessel alone, is for every case.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray

from odisar.baselines.interface import Reference
from odisar.baselines.neural.layers import HorizonOutput
from odisar.baselines.neural.learning import SharedFit, build_network, reference_windows
from odisar.baselines.neural.published_network import PublishedNetwork
from odisar.baselines.neural.scoring import NotFittedError, root_mean_square
from odisar.errors import OdisarError
from odisar.fitting import FitBudget, Lesson, fit_network, one_thread
from odisar.recordings.schema import Recording
from odisar.seeding import derive_seed
from odisar.windows.targets import horizon_targets
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import Batch, WindowSpec

#: Windows of a batch, in training and in scoring; as attention runs over them, part of the recipe.
PUBLISHED_BATCH = 64
#: Share of the training that the first phase has: 120 of 220 epochs.
_JOINT_SHARE = 120 / 220


def fit_published_network(reference: Reference, budget: FitBudget) -> PublishedNetwork:
    """Return the network after both phases; the budget's batch gives way to the published one."""
    train, held_out = reference_windows(reference)
    seed = derive_seed(reference.seed, "published-recipe")
    features = train.samples.shape[1]
    network = build_network(lambda: PublishedNetwork(reference.spec, features), seed)
    budget = replace(budget, batch_size=PUBLISHED_BATCH)
    lesson = Lesson("published recipe", network.joint_loss, train, held_out, noise="dropout")
    fit_network(network, lesson, budget.part(_JOINT_SHARE), derive_seed(seed, "joint"))
    network.keep_only_reconstruction_trainable()
    lesson = replace(lesson, loss=network.reconstruction_loss)
    fit_network(network, lesson, budget.part(1 - _JOINT_SHARE), derive_seed(seed, "fine-tuning"))
    return network


class PublishedRecipe:
    """The published score at t: it is told the states after t, and mixes recordings.

    NOT DEPLOYABLE. A window's score depends on its own future and on the other windows of its
    batch, those of other recordings included. It stands at the window's issue position t; samples
    without a whole horizon after them have none (NaN).

    To have a score every ``stride_steps``, windows w + h steps apart are scored again and again,
    each time ``stride_steps`` later, so that a batch always holds what a published one would.
    The published windows themselves are those of the first pass. In between, the last score holds.
    """

    def __init__(self, network: SharedFit[PublishedNetwork], *, stride_steps: int = 10) -> None:
        self._shared, self._stride_steps = network, stride_steps
        self._network: PublishedNetwork | None = None

    def fit(self, reference: Reference) -> None:
        """Fit the network, or take over the one that was fitted on this very reference.

        Raises OdisarError where the stride leaves out some of the published windows, or the
        window's context and horizon differ in length.
        """
        spec = reference.spec
        length = spec.context_steps + spec.horizon_steps
        if length % self._stride_steps:
            raise OdisarError(
                f"stride_steps={self._stride_steps} must divide the window of {length} steps, or "
                "the published windows are not among those scored; take one of its divisors"
            )
        self._spec, self._scaler = spec, reference.scaler
        self._network = self._shared.of(reference)

    def score(self, recordings: Sequence[Recording]) -> list[NDArray[np.float64]]:
        """Return for each recording (sample,) the score of the window issued there, or NaN.

        Raises OdisarError if nothing was fitted.
        """
        if self._network is None:
            raise NotFittedError(type(self))
        windows = WindowSet(recordings, self._scaler, self._spec)
        values = np.concatenate([recording.values for recording in recordings])
        place = _places_in_segment(recordings, self._spec)
        scores = np.full(len(windows), np.nan)
        with one_thread(), torch.inference_mode():
            for chosen in self._batches(place):
                batch = windows.gather(chosen)
                told = self._told(batch, values[windows.issues[chosen].numpy()])
                output: HorizonOutput = self._network(batch.context, told)
                error = root_mean_square(output.reconstruction - output.forecast)
                scores[chosen.numpy()] = error.numpy()
        lasting = np.arange(len(windows)) - place % self._stride_steps
        joined = np.full(len(values), np.nan)
        joined[windows.issues.numpy()] = scores[lasting]
        borders = np.cumsum([len(recording.time_s) for recording in recordings])[:-1]
        return np.split(joined, borders)

    def _batches(self, place: NDArray[np.int64]) -> Iterator[torch.Tensor]:
        """Yield positions of windows that are w + h steps apart, over all recordings."""
        length = self._spec.context_steps + self._spec.horizon_steps
        for first in range(0, length, self._stride_steps):
            chosen = torch.from_numpy(np.flatnonzero(place % length == first))
            if len(chosen):
                yield from torch.split(chosen, PUBLISHED_BATCH)

    def _told(self, batch: Batch, _observed: NDArray[np.float64]) -> torch.Tensor:
        """Return (window, step, state), scaled, what the decoder is told of the horizon."""
        return batch.truth


class PublishedRecipeLastState(PublishedRecipe):
    """The same trained network, told the last observed state h times over instead of the future.

    NOT DEPLOYABLE either. Attention across the batch stays: a score depends on other recordings,
    and through later windows of the same recording still on its future.
    """

    def _told(self, _batch: Batch, observed: NDArray[np.float64]) -> torch.Tensor:
        """Return (window, step, state), scaled, from samples (window, channel) at t."""
        # Each sample twice is a horizon of one step in which nothing changes, whatever the pose.
        standing = np.repeat(observed, 2, axis=0)
        one_step = replace(self._spec, horizon_steps=1)
        states = horizon_targets(standing, np.arange(0, len(standing), 2), one_step)
        scaled = torch.from_numpy(self._scaler.scale_targets(states))
        return scaled.expand(-1, self._spec.horizon_steps, -1)


def _places_in_segment(recordings: Sequence[Recording], spec: WindowSpec) -> NDArray[np.int64]:
    """Return (window,) how many windows of its segment come before each, as ``WindowSet`` has."""
    counts = [
        len(spec.issue_positions(segment, 1))
        for recording in recordings
        for segment in recording.segments
    ]
    return np.concatenate([np.arange(count) for count in counts])
