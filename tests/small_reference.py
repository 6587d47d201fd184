"""References of small systems: what detectors are fitted on in tests."""

from functools import cache
from pathlib import Path

import numpy as np

from odisar.baselines.interface import Reference
from odisar.config.cases import Case
from odisar.config.loader import load_config
from odisar.recordings.schema import Recording, RecordingInfo
from odisar.seeding import generator
from odisar.windows.coordinates import pose_channels, wrap_angle
from odisar.windows.scaling import Scaler
from odisar.windows.windowing import WindowSpec
from small_system import CHANNELS, make_recording

CONTEXT = 20


@cache
def system_case() -> Case:
    """Return the shipped ferry with the channels of the small system and a context of 20 steps."""
    ferry = _shipped("vessel")
    channels = [
        ferry.channels[0 if name == "Command" else 1].model_copy(update={"name": name})
        for name in CHANNELS
    ]
    return _with_short_windows(ferry).model_copy(update={"channels": channels})


@cache
def drive_case() -> Case:
    """Return the shipped robot (relative pose, velocities) with a context of 20 steps."""
    return _with_short_windows(_shipped("robot"))


def system_reference() -> Reference:
    """Return undisturbed recordings of the small system."""
    train = [make_recording(f"train-{i}") for i in range(6)]
    return reference_of(system_case(), train, [make_recording(f"held-out-{i}") for i in range(2)])


def drive_reference() -> Reference:
    """Return undisturbed drives of the robot."""
    train = [make_drive(f"train-{i}") for i in range(6)]
    return reference_of(drive_case(), train, [make_drive(f"held-out-{i}") for i in range(2)])


def reference_of(case: Case, train: list[Recording], held_out: list[Recording]) -> Reference:
    """Return a reference of these recordings, with the case's windows."""
    spec = WindowSpec(
        case.window.context_steps,
        case.window.horizon_steps,
        tuple(case.output_indices),
        tuple(case.command_indices),
        (),
        pose_channels(case),
    )
    return Reference(case, spec, Scaler.fit(train, spec), train, held_out, seed=17)


def make_drive(name: str, samples: int = 200, noise_m: float = 1e-4) -> Recording:
    """Return a drive with jittering stamps whose pose is the sum of what its velocities say."""
    random = generator(23, name)
    steps_s = 0.1 + random.uniform(-0.02, 0.02, samples)
    wanted = random.normal(size=(samples // 10 + 1, 3)) * [0.5, 0.3, 0.4]
    speed = np.repeat(wanted, 10, axis=0)[:samples]
    speed = speed + random.normal(scale=1e-3, size=speed.shape)
    turned = np.cumsum(speed[:, 2] * steps_s)
    middle = turned - speed[:, 2] * steps_s / 2
    along, across = (speed[:, :2] * steps_s[:, None]).T
    x = np.cumsum(np.cos(middle) * along - np.sin(middle) * across)
    y = np.cumsum(np.sin(middle) * along + np.cos(middle) * across)
    x, y = np.stack([x, y]) + random.normal(scale=noise_m, size=(2, samples))
    half = wrap_angle(turned) / 2
    values = np.column_stack([x, y, np.sin(half), np.cos(half), speed])
    info = RecordingInfo("robot", base_seed=name)
    return Recording(name, info, np.cumsum(steps_s), values)


def turned(drive: Recording, angle: float) -> Recording:
    """Return the drive as it is on a map that is turned by an angle in radians."""
    values = drive.values.copy()
    x, y = drive.values[:, :2].T
    values[:, 0] = np.cos(angle) * x - np.sin(angle) * y
    values[:, 1] = np.sin(angle) * x + np.cos(angle) * y
    half = np.arctan2(values[:, 2], values[:, 3]) + angle / 2
    values[:, 2], values[:, 3] = np.sin(half), np.cos(half)
    return changed(drive, values)


def changed(recording: Recording, values: np.ndarray, segments=()) -> Recording:
    """Return the recording with other values or segments."""
    return Recording(
        recording.name, recording.info, recording.time_s, values, recording.intervals, segments
    )


def _shipped(name: str) -> Case:
    return load_config(Path(__file__).parents[1]).cases[name]


def _with_short_windows(case: Case) -> Case:
    window = case.window.model_copy(update={"context_steps": CONTEXT, "horizon_steps": 10})
    return case.model_copy(update={"window": window})
