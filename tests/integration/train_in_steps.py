"""Train the small system's twin in a process of its own, to be killed by a test."""

import dataclasses
import sys
import time
from pathlib import Path

import lightning as L
from safetensors.torch import save_file

from odisar.twin import training
from odisar.twin.devices import use_one_thread
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from small_system import SPEC, make_recording, small_plan


class Slowly(L.Callback):
    """Leaves a test the time to kill this process in the middle of an epoch."""

    def on_train_batch_end(self, *_args: object) -> None:
        time.sleep(0.02)


def main(checkpoints: Path) -> None:
    use_one_thread()
    plan = dataclasses.replace(
        small_plan(), training=small_plan().training.model_copy(update={"epochs": 4})
    )
    train = [make_recording(f"train-{i}") for i in range(4)]
    scaler = Scaler.fit(train, SPEC)
    validation = WindowSet([make_recording("v")], scaler, SPEC, stride_steps=10)
    if "--slowly" in sys.argv:
        build = training.build_trainer
        training.build_trainer = lambda plan, callbacks, plugins=(): build(
            plan, [Slowly(), *callbacks], plugins
        )
    result = training.train_twin(plan, WindowSet(train, scaler, SPEC), validation, checkpoints)
    save_file(result.network.state_dict(), checkpoints / "final.safetensors")
    (checkpoints / "epochs.txt").write_text(str([row["epoch"] for row in result.history]))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
