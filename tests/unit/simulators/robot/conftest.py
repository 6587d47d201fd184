from pathlib import Path

import pytest

from odisar.config.cases import Case
from odisar.config.loader import read_yaml
from odisar.config.robot import RobotFleetConfig, RobotSimulatorConfig
from odisar.config.simulators import SimulatorsConfig
from odisar.simulators.robot.grid import Grid
from odisar.simulators.robot.office import build_office
from odisar.simulators.robot.runs import CHANNELS, simulate_robot

_PARAMS = Path(__file__).parents[4] / "params.yaml"
SEED = 11


@pytest.fixture(scope="session")
def robot() -> RobotSimulatorConfig:
    """The configuration as it is shipped."""
    return SimulatorsConfig.model_validate(read_yaml(_PARAMS)["simulators"]).robot


@pytest.fixture(scope="session")
def robot_case() -> Case:
    """The case as it is shipped."""
    return Case.model_validate(read_yaml(_PARAMS)["cases"]["robot"])


@pytest.fixture(scope="session")
def small_robot(robot) -> RobotSimulatorConfig:
    """A small fleet: every split and every kind of disturbance."""
    fleet = RobotFleetConfig.model_validate(
        {
            "clean": {"train": 2, "calibration": 1, "development": 1, "test": 2},
            "disturbed": {
                "development": {"noise": {"tasks": 1, "strengths": [0.1]}},
                "test": {
                    "noise": {"tasks": 2, "strengths": [1.0, 0.01]},
                    "correlated-noise": {"tasks": 1, "strengths": [0.1]},
                    "bias": {"tasks": 1, "strengths": [0.1, 0.5]},
                    "drift": {"tasks": 1, "strengths": [0.5]},
                    "slip": {"tasks": 1, "strengths": [1.0]},
                    "blocked": {"tasks": 2, "strengths": []},
                    "people": {"tasks": 1, "strengths": []},
                },
            },
        }
    )
    return robot.model_copy(update={"fleet": fleet})


@pytest.fixture(scope="session")
def recordings(small_robot):
    """The small fleet's recordings, by name."""
    made = simulate_robot(small_robot, SEED, CHANNELS)
    return {recording.name: recording for recording in made}


@pytest.fixture(scope="session")
def office(robot) -> Grid:
    """The office of the small fleet."""
    return build_office(robot.office, SEED)
