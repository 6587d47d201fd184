"""Batches for training: which windows an epoch draws depends on the seed and its number alone."""

import math
from collections.abc import Iterator

import lightning as L
import torch
from torch.utils.data import DataLoader, Dataset, Sampler

from odisar.seeding import derive_seed
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import Batch


class _WindowBatches(Dataset[Batch]):
    """Windows fetched a batch at a time: one gather instead of a Python call a window."""

    def __init__(self, windows: WindowSet) -> None:
        self._windows = windows

    def __getitem__(self, positions: torch.Tensor) -> Batch:
        return self._windows.gather(positions)


class EpochSampler(Sampler[torch.Tensor]):
    """Draws ``steps`` random batches an epoch, from a seed that names the epoch.

    Lightning calls ``set_epoch``; a run resumed at an epoch's start so meets the same windows as
    one that was never interrupted.
    """

    def __init__(self, windows: int, batch_size: int, steps: int, seed: int) -> None:
        self._windows, self._batch_size, self._steps, self._seed = windows, batch_size, steps, seed
        self._epoch = 0

    def set_epoch(self, epoch: int) -> None:
        """Choose the epoch whose batches the next iteration yields."""
        self._epoch = epoch

    def __len__(self) -> int:
        return self._steps

    def __iter__(self) -> Iterator[torch.Tensor]:
        random = torch.Generator().manual_seed(derive_seed(self._seed, "epoch", self._epoch))
        for _ in range(self._steps):
            yield torch.randint(self._windows, (self._batch_size,), generator=random)


class OrderedSampler(Sampler[torch.Tensor]):
    """Every window once, in order, in batches."""

    def __init__(self, windows: int, batch_size: int) -> None:
        self._windows, self._batch_size = windows, batch_size

    def __len__(self) -> int:
        return math.ceil(self._windows / self._batch_size)

    def __iter__(self) -> Iterator[torch.Tensor]:
        for start in range(0, self._windows, self._batch_size):
            yield torch.arange(start, min(start + self._batch_size, self._windows))


class WindowDataModule(L.LightningDataModule):
    """Training and validation windows of one set-up."""

    def __init__(
        self,
        train: WindowSet,
        validation: WindowSet,
        *,
        batch_size: int,
        steps_per_epoch: int,
        validation_batch: int,
        seed: int,
    ) -> None:
        super().__init__()
        self._train, self._validation = train, validation
        self._sampler = EpochSampler(len(train), batch_size, steps_per_epoch, seed)
        self._validation_sampler = OrderedSampler(len(validation), validation_batch)

    def train_dataloader(self) -> DataLoader[Batch]:
        """Return ``steps_per_epoch`` random batches."""
        return _loader(self._train, self._sampler)

    def val_dataloader(self) -> DataLoader[Batch]:
        """Return all validation windows, in order."""
        return _loader(self._validation, self._validation_sampler)

    def transfer_batch_to_device(
        self, batch: Batch, device: torch.device, _dataloader_idx: int
    ) -> Batch:
        """Move a batch to the accelerator."""
        return Batch(
            batch.context.to(device),
            batch.known_future.to(device),
            batch.truth.to(device),
            batch.next_sample.to(device),
        )


def _loader(windows: WindowSet, sampler: Sampler[torch.Tensor]) -> DataLoader[Batch]:
    # Without a generator of its own a loader draws from torch's global one, at moments that differ
    # between a resumed and an unbroken run, and would shift the dropout of the epoch.
    return DataLoader(
        _WindowBatches(windows), sampler=sampler, batch_size=None, generator=torch.Generator()
    )
