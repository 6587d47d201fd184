"""Windows of a small system and a twin trained on them, made once a session."""

from dataclasses import replace

import pytest
import torch

from odisar.twin.bundle import TrainedTwin
from odisar.twin.devices import use_one_thread
from odisar.twin.mc_dropout import draw_masks
from odisar.twin.plan import TrainingPlan
from odisar.twin.training import train_twin
from odisar.twin.transformer import TwinTransformer
from odisar.windows.coordinates import PoseChannels
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from small_system import CHANNELS, SPEC, make_recording, small_plan


@pytest.fixture(scope="session")
def plan() -> TrainingPlan:
    """Return a plan that trains in seconds."""
    return small_plan()


@pytest.fixture(scope="session")
def windows() -> tuple[WindowSet, WindowSet]:
    """Return training and validation windows."""
    train = [make_recording(f"train-{i}") for i in range(6)]
    validation = [make_recording(f"validation-{i}") for i in range(2)]
    scaler = Scaler.fit(train, SPEC)
    return WindowSet(train, scaler, SPEC), WindowSet(validation, scaler, SPEC, stride_steps=10)


@pytest.fixture(scope="session")
def trained_twin(
    plan: TrainingPlan,
    windows: tuple[WindowSet, WindowSet],
    tmp_path_factory: pytest.TempPathFactory,
) -> TrainedTwin:
    """Return a trained twin with stored masks."""
    use_one_thread()
    result = train_twin(plan, *windows, tmp_path_factory.mktemp("checkpoints"))
    masks = draw_masks(result.network, 6, "all", 3)
    scaler = Scaler.fit([make_recording(f"train-{i}") for i in range(6)], SPEC)
    return TrainedTwin(result.network, plan.twin, SPEC, scaler, masks, CHANNELS)


@pytest.fixture(scope="session")
def relative_twin(plan: TrainingPlan) -> TrainedTwin:
    """Return a twin of random weights that takes speed and turn rate for x and y of a pose.

    Its heading stands where others have the command.
    """
    pose = PoseChannels(x=1, y=2, heading=(0,), in_degrees=False)
    spec = replace(SPEC, pose=pose, commands=())
    torch.manual_seed(5)
    train = [make_recording(f"train-{i}") for i in range(6)]
    scaler = Scaler.fit(train, spec)
    network = TwinTransformer(plan.twin, spec, len(CHANNELS))
    network.fit_closed_forms(WindowSet(train, scaler, spec))
    masks = draw_masks(network, 6, "all", 3)
    return TrainedTwin(network.eval(), plan.twin, spec, scaler, masks, CHANNELS)
