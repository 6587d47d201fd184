import numpy as np
import pytest

HEADER = "time_s,Rudder,Speed,Heading\n"


def test_values_outside_the_limits_in_a_clean_file(boat):
    boat.spoiled({9: "7,1,99,0.1\n"})
    finding = boat.one("outside -15 to 15 m/s")
    assert (finding.column, finding.row, finding.value) == ("Speed", 9, "99")


def test_degrees_where_radians_are_declared(boat):
    boat.write("a.csv", HEADER + "".join(f"{i},{i},{i / 9},{6 * i}\n" for i in range(30)))
    found = boat.found("outside -3.2 to 3.2 rad")
    assert "looks like degrees" in found[0].remedy


def test_an_outlier_is_not_taken_for_another_unit(boat):
    boat.spoiled({9: "7,1,2,99\n"})
    assert "degrees" not in boat.one("outside -3.2 to 3.2 rad").remedy


def test_a_state_that_never_changes_is_an_error_and_a_command_a_warning(boat):
    boat.write("a.csv", HEADER + "".join(f"{i},7,5,{i / 10}\n" for i in range(30)))
    state, command = boat.one("the state never"), boat.one("the command never")
    assert (state.severity, state.column, state.value) == ("error", "Speed", "5")
    assert (command.severity, command.column) == ("warning", "Rudder")


def test_time_stamps_out_of_order(boat):
    boat.spoiled({10: "8,1,2,0.1\n", 11: "8,2,3,0.2\n", 20: "4,1,2,0.1\n"})
    assert (boat.one("repeated").row, boat.one("repeated").value) == (11, "8")
    assert (boat.one("goes back").row, boat.one("goes back").value) == (20, "4")


@pytest.mark.parametrize("rate_hz", [0.5, 0.98, 1.05, 2.0, 10.0])
def test_another_rate_is_one_error_and_no_gaps(boat, rate_hz):
    lines = (f"{i / rate_hz:.4f},{i % 7},{i % 5},{i % 3}\n" for i in range(300))
    boat.write("a.csv", HEADER + "".join(lines))
    found = boat.read().findings
    assert [finding.problem for finding in found] == ["the rate is not rate_hz=1"]
    assert found[0].value == f"{rate_hz:.4g} Hz"


@pytest.mark.parametrize(
    ("parts", "unit"), [(10**3, "milliseconds"), (10**6, "microseconds"), (10**9, "nanoseconds")]
)
def test_times_in_another_unit_are_recognised(boat, parts, unit):
    lines = (f"{i * parts},{i % 7},{i % 5},{i % 3}\n" for i in range(300))
    boat.write("a.csv", HEADER + "".join(lines))
    remedy = boat.one("the rate is not rate_hz=1").remedy
    assert remedy == f"the times look like {unit}: divide them by {parts:,}, time is in seconds"


def test_jitter_below_half_a_sample_is_fine(boat):
    jitter = np.random.default_rng(1).uniform(-0.24, 0.24, 300)
    lines = (f"{i + jitter[i]:.4f},{i % 7},{i % 5},{i % 3}\n" for i in range(300))
    boat.write("a.csv", HEADER + "".join(lines))
    assert boat.read().findings == []


def test_a_sample_between_the_samples(boat):
    boat.spoiled({10: "8,1,2,0.1\n8.2,1,2,0.1\n"})
    assert boat.one("shorter than half a period").row == 11


def test_a_gap_is_a_warning_and_a_border_between_segments(boat):
    boat.spoiled({15: ""})
    finding = boat.one("a gap")
    assert (finding.severity, finding.row, finding.value) == ("warning", 15, "2")
    assert boat.read().recordings[0].segments == ((0, 13), (13, 29))


def test_a_missing_sample_within_the_allowed_gap_is_named(make_boat):
    boat = make_boat(max_gap_s=3.0)
    boat.spoiled({15: ""})
    assert boat.one("windows cross it").severity == "warning"
    assert boat.read().recordings[0].segments == ((0, 29),)


def test_a_recording_shorter_than_a_window(boat):
    boat.good("a.csv", samples=9)
    finding = boat.one("the recording is shorter")
    assert (finding.severity, finding.value) == ("error", "9 samples")
    boat.good("a.csv", samples=10)
    assert boat.read().findings == []


def test_a_short_segment_beside_a_long_one_is_a_warning(boat):
    boat.spoiled({5: ""})
    finding = boat.one("shorter than context and horizon")
    assert (finding.severity, finding.row, finding.value) == ("warning", 2, "3 samples")


def test_every_segment_too_short_is_an_error(boat):
    boat.spoiled({10: ""}, samples=18)
    assert boat.one("every segment is shorter").severity == "error"


@pytest.mark.parametrize("rate_hz", [100.0, 1000.0])
def test_seconds_since_1970_do_not_make_steps_too_short_or_too_long(make_boat, rate_hz):
    """A step of just 0.5 or 1.5 periods is fine, and rounds to a little more or less."""
    boat = make_boat(rate_hz=rate_hz, max_gap_s=1.0, short_lead_s=1 / rate_hz)
    places = np.arange(1200.0)
    places[50::120] += 0.5
    times = (1.7e9 + places / rate_hz).tolist()
    lines = (f"{time_s!r},{i % 7},{i % 5},{i % 3}\n" for i, time_s in enumerate(times))
    boat.write("a.csv", HEADER + "".join(lines))
    assert boat.read().findings == []


def quaternion_boat(make_boat, turned):
    channels = [
        {"name": name, "unit": "1", "role": "state", "output": True, "known_ahead": False}
        | {"min": -30.0, "max": 30.0}
        for name in ("X", "Y", "Z", "W")
    ]
    pose = {"x": "X", "y": "Y", "heading": ["Z", "W"], "coordinates": "absolute"}
    boat = make_boat(channels=channels, pose=pose)
    rows = [[i, i % 7, i % 5, np.sin(i / 9), np.cos(i / 9)] for i in range(30)]
    for place, heading in turned.items():
        rows[place][3:] = heading
    lines = [",".join(map(str, map(float, row))) for row in rows]
    boat.write("a.csv", "\n".join(["time_s,X,Y,Z,W", *lines, ""]))
    return boat


def test_a_heading_that_is_no_unit_quaternion(make_boat):
    boat = quaternion_boat(make_boat, {4: [0.0, 0.0], 9: [0.0, 1.0]})
    finding = boat.one("z and w are no unit quaternion")
    assert (finding.severity, finding.column) == ("error", "Z")
    assert (finding.row, finding.value) == (6, "0")


def test_a_heading_with_rounded_digits_is_a_unit_quaternion(make_boat):
    assert quaternion_boat(make_boat, {4: [0.70, 0.71]}).read().findings == []
