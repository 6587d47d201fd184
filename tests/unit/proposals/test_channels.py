"""What a column is to the twin is guessed from its name and from what it does."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from odisar.proposals.channels import MAX_CHANNELS, guess_channels, pick_columns
from odisar.proposals.columns import read_columns, widened
from odisar.proposals.poses import guess_pose
from odisar.proposals.samples import Sample

STEPS = np.arange(300)
NOISE = np.random.default_rng(0).normal(size=(40, len(STEPS)))


def sample(**columns):
    return Sample(Path("a.csv"), pd.DataFrame(columns))


def columns_of(**columns):
    return read_columns([sample(**columns)], list(columns))


def guess(name, values):
    columns, _ = columns_of(**{name: values})
    other, _ = columns_of(other=NOISE[30])
    return guess_channels([*columns, *other], {})[0]


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (STEPS * 1.0, "counts the rows"),
        (np.full(len(STEPS), 3.0), r"never changes \(3\)"),
        (np.full(len(STEPS), "auto"), "text"),
        (np.where(STEPS % 2, "True", "False"), "write 1 and 0"),
        (np.where(STEPS % 3, np.nan, NOISE[0]), "67 % of its cells are empty"),
        (NOISE[1], "the same values as 'first'"),
    ],
)
def test_what_cannot_be_a_channel_is_left_out_with_the_reason(values, reason):
    columns, left_out = columns_of(first=NOISE[1], other=values)
    assert [column.name for column in columns] == ["first"]
    assert re.search(reason, left_out["other"])


def test_a_second_clock_is_no_channel():
    assert columns_of(v=NOISE[0], unix_time=1.7e9 + STEPS * 0.2)[1] == {
        "unix_time": "another clock"
    }


@pytest.mark.parametrize("name", ["rudder_cmd", "throttle", "Lenkwinkel Soll", "pump setpoint"])
def test_a_name_can_tell_a_command(name):
    assert guess(name, NOISE[0]).role == "command"


def test_values_that_are_held_are_taken_for_a_command_with_a_doubt():
    found = guess("u7", np.repeat(NOISE[0][:15], 20))
    assert found.role == "command"
    assert any("held still in 95 %" in doubt for doubt in found.doubts)


def test_a_slow_measurement_is_a_state_that_is_not_forecast():
    found = guess("battery voltage", np.repeat(24 - NOISE[0][:15] ** 2, 20))
    assert (found.role, found.output) == ("state", False)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("heading_deg", (STEPS * 3.0) % 360),
        ("orientation_z", np.sin(STEPS / 50)),
        ("distance", np.cumsum(np.abs(NOISE[0]))),
        ("mode_code", STEPS // 2 % 3 * 1.0),
    ],
)
def test_states_that_make_no_sense_as_a_forecast_are_not(name, values):
    assert not guess(name, values).output


def test_something_is_always_forecast():
    columns, _ = columns_of(rudder_cmd=NOISE[0])
    found = guess_channels(columns, {})
    assert (found[0].role, found[0].output) == ("state", True)


def test_limits_are_twice_what_was_seen_unless_the_quantity_has_its_own():
    speed = guess("speed [m/s]", np.linspace(1, 4.1, len(STEPS)) + 0.01 * NOISE[0])
    assert speed.low == -speed.high
    assert 8 <= speed.high <= 9
    assert any("limits: seen" in doubt for doubt in speed.doubts)
    roll = guess("roll (deg)", NOISE[0])
    assert (roll.low, roll.high) == (-90, 90)
    assert not roll.doubts
    assert guess("pressure [bar]", 2 + NOISE[0] ** 2).low == 0


def test_a_number_for_nothing_measured_is_no_limit():
    values = np.where(STEPS == 50, -999.0, NOISE[0])
    found = guess("v", values)
    assert found.low > -999
    assert "holds -999: nothing measured?" in found.doubts


def test_extremes_of_whole_recordings_count():
    columns, _ = columns_of(v=NOISE[0])
    wider = widened(columns[0], [np.array([0.0, 50.0]), np.array([-9999.0, 1.0])])
    assert (wider.high, wider.sentinels) == (50.0, (-9999.0,))
    assert wider.low > -10


def test_of_too_many_columns_the_lively_ones_are_kept_in_order():
    many = {f"c{i:02d}": NOISE[i] for i in range(20)}
    many["c03"] = np.repeat(NOISE[3][:15], 20)
    columns, _ = columns_of(**many)
    kept, surplus = pick_columns(columns)
    assert len(kept) == MAX_CHANNELS
    assert "c03" in surplus
    assert [column.name for column in kept] == sorted(column.name for column in kept)


@pytest.mark.parametrize(
    ("names", "heading"),
    [
        (("x", "y", "yaw"), ["yaw"]),
        (("pos_x", "pos_y", "theta"), ["theta"]),
        (("Position X [m]", "Position Y [m]", "Heading (rad)"), ["Heading (rad)"]),
        (
            ("position_x", "position_y", "orientation_z", "orientation_w"),
            ["orientation_z", "orientation_w"],
        ),
        (("easting", "northing", "psi_deg"), ["psi_deg"]),
    ],
)
def test_a_pose_is_told_by_its_names(names, heading):
    values = [NOISE[i] / 5 for i in range(len(names))]
    columns, _ = columns_of(velocity_x=NOISE[9], **dict(zip(names, values, strict=True)))
    pose = guess_pose(guess_channels(columns, {}), columns)
    assert (pose.x, pose.y, list(pose.heading)) == (*names[:2], heading)


def test_velocities_are_no_pose():
    columns, _ = columns_of(velocity_x=NOISE[0], velocity_y=NOISE[1], yaw_rate=NOISE[2])
    assert guess_pose(guess_channels(columns, {}), columns) is None


@pytest.mark.parametrize(
    "name",
    ["motor_1", "motor2", "pwm_left", "servo", "esc3", "valve_pct", "Ventil", "Solldruck [bar]",
     "pressure setpoint", "thrust", "duty"],
)  # fmt: skip
def test_what_drives_a_machine_is_a_command(name):
    assert guess(name, NOISE[0]).role == "command"


@pytest.mark.parametrize("name", ["motor_current", "motor temperature", "valve position ist"])
def test_what_is_measured_of_it_is_a_state(name):
    assert guess(name, NOISE[0]).role == "state"


def test_numbered_siblings_have_one_role_and_are_forecast_together():
    idle = np.repeat(NOISE[0][:15], 20)
    columns, _ = columns_of(wheel_1=NOISE[1], wheel_2=idle, wheel_3=NOISE[3], v=NOISE[4])
    found = guess_channels(columns, {})
    assert {(item.role, item.output) for item in found} == {("state", True)}
    assert "forecast like wheel_1" in found[1].doubts
    others = {f"{letter}_x": NOISE[i] for i, letter in enumerate("abcdef")}
    columns, _ = columns_of(**others, **{f"wheel_{i}": NOISE[10 + i] for i in range(4)})
    assert {item.output for item in guess_channels(columns, {})[6:]} == {False}


@pytest.mark.parametrize("name", ["load_pct", "p_bar", "level %", "flow", "spannung", "n [1/min]"])
def test_an_amount_that_is_never_negative_has_no_negative_limit(name):
    assert guess(name, 150 + 30 * NOISE[0]).low == 0


@pytest.mark.parametrize(
    ("name", "values", "unit"),
    [
        ("yaw", (STEPS * 3.1) % 360 - 180, "deg"),
        ("course", (STEPS * 3.1) % 360, "deg"),
        ("heading", (STEPS * 0.07) % 6.28 - 3.14, "rad"),
        ("heading", (STEPS * 0.01) % 6.28, "1"),
        ("yaw_rate", (STEPS * 0.07) % 6.28 - 3.14, "1"),
    ],
)
def test_a_direction_that_goes_all_around_tells_its_unit(name, values, unit):
    assert guess(name, values).unit == unit
