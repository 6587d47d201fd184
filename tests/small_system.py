"""A small system whose recordings take no time to make: what most tests stand on."""

import numpy as np

from odisar.config.learning import TrainingConfig, TwinConfig
from odisar.recordings.schema import Interval, Recording, RecordingInfo
from odisar.seeding import generator
from odisar.twin.plan import TrainingPlan
from odisar.windows.windowing import WindowSpec

SPEC = WindowSpec(context_steps=20, horizon_steps=10, outputs=(1, 2), commands=(0,), known_ahead=())
CHANNELS = ("Command", "Speed", "Turn Rate")
_STATISTICS = {"mean_steps": 10, "size_steps": 5, "recent_steps": 3, "recent_share": 0.3}
#: A score that looks back a few samples, as a case in params.yaml has it.
SCORE = {
    "innovation": _STATISTICS,
    "consistency": dict(_STATISTICS),
    "scatter": {"steps": 10, "share": 0.2},
    "noise": {"lasting_steps": 6, "recent_steps": 2, "recent_share": 0.5, "margin": 0.2},
    "shift": {"memory_steps": 12, "margin": 0.2},
    "release": {"steps": 8, "share": 0.5},
}


def make_recording(name: str, samples: int = 300, push: float = 0.0) -> Recording:
    """Return a damped system driven by a stepping command; ``push`` disturbs its middle third."""
    random = generator(7, name)
    command = np.repeat(random.choice([-1.0, 0.0, 1.0], samples // 15 + 1), 15)[:samples]
    noise = random.normal(scale=0.02, size=(samples, 2))
    states = np.zeros((samples, 2))
    third = samples // 3
    for i in range(1, samples):
        disturbed = push if third <= i < 2 * third else 0.0
        turn = 0.9 * states[i - 1, 1] + 0.1 * command[i - 1] + disturbed
        speed = 0.95 * states[i - 1, 0] + 0.05 * (1 - turn**2) + disturbed
        states[i] = speed, turn
    values = np.column_stack([command, states + noise])
    time_s = np.arange(samples, dtype=np.float64)
    intervals = (Interval(float(third), float(2 * third), "push"),) if push else ()
    info = RecordingInfo("system", disturbance="push" if push else "none", base_seed=name)
    return Recording(name, info, time_s, values, intervals)


def make_gusty(name: str, samples: int = 400) -> Recording:
    """Return a machine of exact sensors that gusts push about: most are weak, a few are not."""
    random = generator(7, "gusty", name)
    command = np.repeat(random.choice([-1.0, 0.0, 1.0], samples // 20 + 1), 20)[:samples]
    gusts = 0.05 * random.standard_t(3, size=(samples, 2)) @ [[1.0, 0.3], [0.0, 1.0]]
    states = np.zeros((samples, 2))
    for i in range(1, samples):
        states[i] = 0.9 * states[i - 1] + 0.1 * command[i - 1] + gusts[i]
    info = RecordingInfo("system", base_seed=name)
    time_s = np.arange(samples, dtype=np.float64)
    return Recording(name, info, time_s, np.column_stack([command, states]))


def small_plan() -> TrainingPlan:
    """Return a plan that trains in seconds."""
    twin = TwinConfig(
        patch_steps=5,
        model_dim=16,
        heads=2,
        layers=1,
        feedforward_dim=32,
        reconstruction_dim=16,
        dropout=0.1,
        detach_reconstruction=False,
        closed_form_lags=5,
        residual_forecast=False,
    )
    training = TrainingConfig(
        batch_size=16,
        learning_rate=3.0e-3,
        epochs=3,
        steps_per_epoch=40,
        patience_epochs=3,
        gradient_clip=1.0,
        weigh_loss=True,
        validation_stride_steps=10,
    )
    return TrainingPlan(twin, training, seed=11, accelerator="cpu")
