from pathlib import Path

import pytest

from odisar.config.loader import read_yaml
from odisar.config.simulators import SimulatorsConfig, VesselSimulatorConfig

_PARAMS = Path(__file__).parents[3] / "params.yaml"


@pytest.fixture(scope="session")
def vessel() -> VesselSimulatorConfig:
    """The configuration as it is shipped."""
    return SimulatorsConfig.model_validate(read_yaml(_PARAMS)["simulators"]).vessel


@pytest.fixture(scope="session")
def small_vessel(vessel) -> VesselSimulatorConfig:
    """A small fleet: one variant of each manoeuvre, every split, case and component."""
    maneuvers = vessel.maneuvers.model_copy(
        update={
            "zigzag_deg": [20],
            "turning_deg": [30],
            "random": {"high": vessel.maneuvers.random["high"]},
        }
    )
    fleet = vessel.fleet.model_copy(
        update={
            "clean": {"train": {"zigzag": 2, "turning": 2, "random": 2}},
            "disturbed": {
                "test": vessel.fleet.disturbed["test"].model_copy(update={"strengths": [0.1, 1.0]})
            },
        }
    )
    return vessel.model_copy(update={"maneuvers": maneuvers, "fleet": fleet})
