"""Take part in a study that another process takes part in as well."""

import sys

from odisar.config.learning import LearningRateRange, TuningConfig
from odisar.twin.devices import use_one_thread
from odisar.twin.tuning import tune_twin
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from small_system import SPEC, make_recording, small_plan

TUNING = TuningConfig(
    trials=6,
    steps_per_trial=20,
    reports_per_trial=2,
    pruner_warmup_trials=6,
    learning_rate=LearningRateRange(low=1.0e-4, high=1.0e-2),
    model_dim=[8, 16],
    layers=[1],
    feedforward_dim=[32],
    storage="journal",
)


def main(journal: str) -> None:
    use_one_thread()
    train = [make_recording(f"train-{i}") for i in range(3)]
    scaler = Scaler.fit(train, SPEC)
    validation = WindowSet([make_recording("v")], scaler, SPEC, stride_steps=10)
    windows = WindowSet(train, scaler, SPEC), validation
    tune_twin(small_plan(), TUNING, windows, journal, "shared")


if __name__ == "__main__":
    main(sys.argv[1])
