"""Windows of a small system and a twin trained on them, made once a session."""

import pytest

from odisar.twin.bundle import TrainedTwin
from odisar.twin.devices import use_one_thread
from odisar.twin.mc_dropout import draw_masks
from odisar.twin.training import TrainingPlan, train_twin
from odisar.windows.scaling import Scaler
from odisar.windows.windowing import WindowSet
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
    scaler = Scaler.fit(train)
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
    scaler = Scaler.fit([make_recording(f"train-{i}") for i in range(6)])
    return TrainedTwin(result.network, plan.twin, SPEC, scaler, masks, CHANNELS)
