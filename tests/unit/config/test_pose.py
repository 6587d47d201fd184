"""What a pose may be declared as."""

from pathlib import Path

import pytest
from pydantic import ValidationError

from odisar.config.cases import Case
from odisar.config.loader import load_config

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def robot():
    return load_config(ROOT).cases["robot"].model_dump()


def channel(case, name):
    return next(item for item in case["channels"] if item["name"] == name)


def test_one_half_of_a_quaternion_cannot_be_forecast(robot):
    channel(robot, "orientation_w")["output"] = True
    with pytest.raises(ValidationError, match="both outputs, or neither"):
        Case.model_validate(robot)
    channel(robot, "orientation_z")["output"] = True
    Case.model_validate(robot)


def test_a_rate_is_no_heading(robot):
    robot["pose"]["heading"] = ["angular_velocity_z"]
    with pytest.raises(ValidationError, match="is in 'rad/s'; an angle is in rad or deg"):
        Case.model_validate(robot)


def test_a_command_is_no_part_of_a_pose(robot):
    channel(robot, "position_x").update(role="command", output=False)
    with pytest.raises(ValidationError, match="position_x must be states, not commands"):
        Case.model_validate(robot)


def test_a_channel_is_named_once(robot):
    robot["pose"]["y"] = "position_x"
    with pytest.raises(ValidationError, match="a channel is named twice"):
        Case.model_validate(robot)
