"""Train the small system's twin in a process of its own, to be killed by a test."""

import sys
import time
from pathlib import Path

import lightning as L
from small_system import SPEC, make_recording

from odisar.config.learning import TrainingConfig, TwinConfig
from odisar.twin import training
from odisar.windows.scaling import Scaler
from odisar.windows.windowing import WindowSet


class Slowly(L.Callback):
    """Leaves a test the time to kill this process in the middle of an epoch."""

    def on_train_batch_end(self, *_args: object) -> None:
        time.sleep(0.02)


def main(checkpoints: Path) -> None:
    training.use_one_thread()
    twin = TwinConfig(
        patch_steps=5,
        model_dim=16,
        heads=2,
        layers=1,
        feedforward_dim=32,
        reconstruction_dim=16,
        dropout=0.2,
        detach_reconstruction=False,
    )
    settings = TrainingConfig(
        batch_size=8,
        learning_rate=3.0e-3,
        epochs=4,
        steps_per_epoch=25,
        patience_epochs=4,
        gradient_clip=1.0,
        validation_stride_steps=10,
    )
    train = [make_recording(f"train-{i}") for i in range(4)]
    scaler = Scaler.fit(train)
    validation = WindowSet([make_recording("v")], scaler, SPEC, stride_steps=10)
    plan = training.TrainingPlan(twin, settings, seed=5, accelerator="cpu")
    if "--slowly" in sys.argv:
        build = training.build_trainer
        training.build_trainer = lambda plan, callbacks, plugins=(): build(
            plan, [Slowly(), *callbacks], plugins
        )
    result = training.train_twin(plan, WindowSet(train, scaler, SPEC), validation, checkpoints)
    from safetensors.torch import save_file

    save_file(result.network.state_dict(), checkpoints / "final.safetensors")
    (checkpoints / "epochs.txt").write_text(str([row["epoch"] for row in result.history]))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
