"""Compare forecasts of the robot's twin in relative and in absolute coordinates.

Trains one twin of each kind on the simulated robot's training tasks, with the parameters of
params.yaml and one torch thread, and compares forecasts of position on the validation tasks with
standing still and with keeping the last velocity. Run it from the project's root after `make data`:

    .venv/bin/python benchmarks/robot_coordinates.py
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast

import numpy as np
from numpy.typing import NDArray

from odisar.capability.scoring import Scorer
from odisar.config.cases import Case
from odisar.config.loader import Config, load_config
from odisar.recordings.reader import read_case
from odisar.recordings.schema import Recording
from odisar.recordings.splits import assign_splits
from odisar.twin.bundle import TrainedTwin
from odisar.twin.devices import use_one_thread
from odisar.twin.mc_dropout import draw_masks
from odisar.twin.plan import TrainingPlan
from odisar.twin.training import train_twin
from odisar.windows.coordinates import PoseChannels, moved_from, pose_channels
from odisar.windows.scaling import Scaler
from odisar.windows.targets import recorded_states
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import WindowSpec

CASE = "robot"
LEADS_S = (1.0, 3.0, 6.0)
STRIDE_STEPS = 7
Errors = NDArray[np.float64]


def coordinates(case: Case, kind: str) -> Case:
    """Return the case with its pose in other coordinates."""
    pose = {**case.model_dump()["pose"], "coordinates": kind}
    return Case.model_validate({**case.model_dump(), "pose": pose})


def train(
    config: Config, case: Case, parts: dict[str, list[Recording]], folder: Path
) -> TrainedTwin:
    """Return a twin trained as the pipeline does, without tuning."""
    spec = WindowSpec(
        case.window.context_steps,
        case.window.horizon_steps,
        tuple(case.output_indices),
        tuple(case.command_indices),
        (),
        pose_channels(case),
    )
    scaler = Scaler.fit(parts["train"], spec)
    stride = config.training.validation_stride_steps
    validation = WindowSet(parts["validation"], scaler, spec, stride_steps=stride)
    plan = TrainingPlan(config.twin, config.training, config.seed, "cpu")
    result = train_twin(plan, WindowSet(parts["train"], scaler, spec), validation, folder)
    masks = draw_masks(result.network, 2, "all", 0)
    names = tuple(case.channel_names)
    return TrainedTwin(result.network, config.twin, spec, scaler, masks, names)


def horizon(recording: Recording, case: Case) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return issue positions and the positions (window, step, 2) recorded after them."""
    window = case.window
    at = np.arange(window.context_steps, len(recording.time_s) - window.horizon_steps, STRIDE_STEPS)
    steps = at[:, None] + np.arange(1, window.horizon_steps + 1)
    return at, recording.values[steps][..., case.output_indices]


def twin_errors(twin: TrainedTwin, recordings: list[Recording], case: Case) -> Errors:
    """Return (window, step) distances [m] between forecast and recorded position."""
    scorer, distances = Scorer(twin, 256, "cpu"), []
    for recording in recordings:
        at, truth = horizon(recording, case)
        targets = twin.scaler.unscale_targets(scorer.forecast(recording, at).forecast.numpy())
        states = recorded_states(targets, recording, at, twin.spec)
        distances.append(np.linalg.norm(states - truth, axis=-1))
    return np.concatenate(distances)


def simple_errors(recordings: list[Recording], case: Case, *, moving: bool) -> Errors:
    """Return the same of a robot that stands still, or keeps the velocity it has."""
    names = case.channel_names
    velocity = [names.index(f"linear_velocity_{axis}") for axis in "xy"]
    turn = names.index("angular_velocity_z")
    channels = cast("PoseChannels", pose_channels(coordinates(case, "relative")))
    distances = []
    for recording in recordings:
        at, truth = horizon(recording, case)
        pose = channels.read(recording.values[at])
        ahead_s = np.arange(1, case.window.horizon_steps + 1) / case.rate_hz
        rates = recording.values[at][:, [*velocity, turn]] * float(moving)
        reached, step = pose[:, None].repeat(len(ahead_s), axis=1), 1 / case.rate_hz
        for i in range(len(ahead_s)):
            reached[:, i] = pose = moved_from(pose, rates * step)
        distances.append(np.linalg.norm(reached[..., :2] - truth, axis=-1))
    return np.concatenate(distances)


def main() -> None:
    """Train, compare, print."""
    use_one_thread()
    config = load_config(Path.cwd())
    case = config.cases[CASE]
    parts = assign_splits(read_case(CASE, case, Path.cwd()).recordings, case, {}, None, config.seed)
    errors = {
        "stands still": simple_errors(parts["validation"], case, moving=False),
        "keeps its velocity": simple_errors(parts["validation"], case, moving=True),
    }
    for kind in ("absolute", "relative"):
        declared = coordinates(case, kind)
        with TemporaryDirectory() as folder:
            twin = train(config, declared, parts, Path(folder))
        errors[f"twin, {kind}"] = twin_errors(twin, parts["validation"], declared)
    print(f"RMSE of position [m] on {len(parts['validation'])} validation tasks")
    print(f"{'':20s}" + "".join(f"{lead:>8g} s" for lead in LEADS_S))
    for name, found in errors.items():
        at = [round(lead * case.rate_hz) - 1 for lead in LEADS_S]
        print(f"{name:20s}" + "".join(f"{np.sqrt(np.mean(found[:, i] ** 2)):10.3f}" for i in at))


if __name__ == "__main__":
    main()
