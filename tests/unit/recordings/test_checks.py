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
