"""Twins that are their closed form: of drives, whose pose is relative, and of a gusty machine."""

import pytest
import torch

from odisar.recordings.schema import Recording
from odisar.twin.bundle import TrainedTwin
from odisar.twin.mc_dropout import draw_masks
from odisar.twin.plan import TrainingPlan
from odisar.twin.transformer import TwinTransformer
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import WindowSpec
from small_reference import drive_reference
from small_system import CHANNELS, SPEC, make_gusty


@pytest.fixture(scope="session")
def drive_twin(plan: TrainingPlan) -> TrainedTwin:
    """Return a twin of drives."""
    made = drive_reference()
    return closed_form_twin(plan, made.spec, made.train, tuple(made.case.channel_names))


@pytest.fixture(scope="session")
def gusty_twin(plan: TrainingPlan) -> TrainedTwin:
    """Return a twin of the gusty machine."""
    return closed_form_twin(plan, SPEC, [make_gusty(f"train-{i}") for i in range(6)], CHANNELS)


def closed_form_twin(
    plan: TrainingPlan, spec: WindowSpec, train: list[Recording], names: tuple[str, ...]
) -> TrainedTwin:
    """Return a twin that forecasts the next sample by its closed form: nothing has trained it."""
    torch.manual_seed(5)
    scaler, network = Scaler.fit(train, spec), TwinTransformer(plan.twin, spec, len(names))
    network.fit_closed_forms(WindowSet(train, scaler, spec))
    masks = draw_masks(network, 2, "all", 3)
    return TrainedTwin(network.eval(), plan.twin, spec, scaler, masks, names)
