"""Train a twin: resumable, repeatable, stopped by the validation forecast error."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import lightning as L
import torch
from lightning.pytorch.callbacks import Callback, EarlyStopping, ModelCheckpoint

from odisar.seeding import derive_seed
from odisar.twin.checkpoints import SafetensorsCheckpointIO, read_checkpoint
from odisar.twin.devices import pick_device
from odisar.twin.lightning_module import VALIDATION_METRIC, TwinModule
from odisar.twin.plan import TrainingPlan
from odisar.twin.progress import EpochHistory
from odisar.twin.transformer import TwinTransformer
from odisar.windows.datamodule import WindowDataModule
from odisar.windows.window_set import WindowSet

#: Windows a validation batch holds; a matter of memory, not of results.
_VALIDATION_BATCH = 256
_NETWORK_PREFIX = "network."


@dataclass(frozen=True)
class TrainingResult:
    """The network with the lowest validation forecast error, and how it came about.

    ``history`` has one row an epoch; ``windows_seen`` counts windows drawn, repeats included.
    """

    network: TwinTransformer
    history: list[dict[str, float]]
    best_validation_loss: float
    windows_seen: int


def build_module(plan: TrainingPlan, windows: WindowSet) -> TwinModule:
    """Return a fresh module: its weights depend on the plan's seed, closed forms on the windows."""
    return TwinModule(replace(plan, seed=derive_seed(plan.seed, "twin")), windows)


def build_data(plan: TrainingPlan, train: WindowSet, validation: WindowSet) -> WindowDataModule:
    """Return the batches of a run."""
    return WindowDataModule(
        train,
        validation,
        batch_size=plan.training.batch_size,
        steps_per_epoch=plan.training.steps_per_epoch,
        validation_batch=_VALIDATION_BATCH,
        seed=derive_seed(plan.seed, "batches"),
    )


def build_trainer(
    plan: TrainingPlan,
    callbacks: Sequence[Callback],
    plugins: Sequence[SafetensorsCheckpointIO] = (),
) -> L.Trainer:
    """Return a trainer without its own files, bars and checkpoints: the callbacks bring them."""
    return L.Trainer(
        accelerator=pick_device(plan.accelerator),
        devices=1,
        max_epochs=plan.training.epochs,
        gradient_clip_val=plan.training.gradient_clip,
        callbacks=list(callbacks),
        plugins=list(plugins),
        enable_checkpointing=any(isinstance(item, ModelCheckpoint) for item in callbacks),
        enable_progress_bar=False,
        enable_model_summary=False,
        logger=False,
        num_sanity_val_steps=0,
    )


def train_twin(
    plan: TrainingPlan,
    train: WindowSet,
    validation: WindowSet,
    checkpoints: Path,
    *,
    name: str = "twin",
    position: int = 0,
) -> TrainingResult:
    """Train, or go on from the last epoch in ``checkpoints``, and return the best network.

    A run that was killed and resumed equals one that was not: batches and dropout of an epoch are
    seeded by its number, and checkpoints are written between epochs.
    """
    history = EpochHistory(name, position)
    saver = ModelCheckpoint(
        checkpoints,
        filename="best",
        monitor=VALIDATION_METRIC,
        save_last=True,
        save_top_k=1,
        save_on_train_epoch_end=True,
    )
    stopper = EarlyStopping(
        VALIDATION_METRIC, patience=plan.training.patience_epochs, check_on_train_epoch_end=True
    )
    trainer = build_trainer(plan, [history, stopper, saver], [SafetensorsCheckpointIO()])
    last = checkpoints / "last.ckpt"
    trainer.fit(
        build_module(plan, train),
        datamodule=build_data(plan, train, validation),
        ckpt_path=last if last.exists() else None,
    )
    network = build_module(plan, train).network
    network.load_state_dict(_network_weights(Path(saver.best_model_path)))
    return TrainingResult(
        network=network.eval(),
        history=history.rows,
        best_validation_loss=min(row[VALIDATION_METRIC] for row in history.rows),
        windows_seen=len(history.rows) * plan.training.steps_per_epoch * plan.training.batch_size,
    )


def _network_weights(checkpoint: Path) -> dict[str, torch.Tensor]:
    weights: dict[str, torch.Tensor] = read_checkpoint(checkpoint)["state_dict"]
    return {name.removeprefix(_NETWORK_PREFIX): value for name, value in weights.items()}
