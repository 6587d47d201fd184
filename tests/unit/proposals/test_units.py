"""A unit is taken from a name where it tells one."""

import pytest

from odisar.proposals.units import unit_of, words


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("v [m/s]", "m/s"),
        ("Roll (deg)", "deg"),
        ("yaw_deg", "deg"),
        ("temp_°C", "°C"),
        ("Temp °C", "°C"),
        ("Ventil%", "%"),
        ("valve_pct", "%"),
        ("level_percent", "%"),
        ("p_bar", "bar"),
        ("speed_mps", "m/s"),
        ("yaw_rate_deg_s", "deg/s"),
        ("accel_m_s2", "m/s2"),
        ("propeller rpm", "RPM"),
        ("rpm", "RPM"),
        ("Drehrate [°/s]", "deg/s"),
        ("wind speed, kn", "kn"),
        ("x_m", "m"),
        ("flow [l/h]", "l/h"),
    ],
)
def test_a_unit_in_the_name_is_sure(name, unit):
    assert unit_of(name) == (unit, True)


@pytest.mark.parametrize("name", ["speed", "x", "v", "channel (2)", "alarm"])
def test_a_name_without_a_unit_is_not(name):
    assert unit_of(name) == ("1", False)


def test_a_single_letter_may_be_a_unit():
    assert unit_of("motor_a") == ("A", False)


def test_the_line_of_units_goes_first():
    assert unit_of("v [km/h]", "m/s") == ("m/s", True)


def test_words_of_a_name_leave_out_its_unit():
    assert words("Position X [m]") == ["position", "x"]
    assert words("motorCurrent_left (A)") == ["motor", "current", "left"]
