import numpy as np
import pytest
from pydantic import ValidationError

from odisar.config.cases import Case
from odisar.recordings.resampling import hold_on_grid, thin_to_grid

RATE_HZ = 10.0
HOLD = {"resample": "hold"}


@pytest.fixture
def jittery():
    """Return times of about 25 Hz and two columns of values."""
    generator = np.random.default_rng(1)
    time_s = 3.0 + np.cumsum(generator.uniform(0.01, 0.07, 400))
    return time_s, generator.normal(size=(400, 2))


def test_the_grid_starts_at_the_first_sample_and_is_regular(jittery):
    time_s, values = jittery
    grid_s, held = hold_on_grid(time_s, values, RATE_HZ)
    assert grid_s[0] == time_s[0]
    np.testing.assert_allclose(np.diff(grid_s), 0.1, rtol=1e-9)
    assert time_s[-1] - 0.1 < grid_s[-1] <= time_s[-1]
    assert held.shape == (len(grid_s), 2)


def test_each_step_holds_the_last_sample_at_or_before_it(jittery):
    time_s, values = jittery
    for moment_s, row in zip(*hold_on_grid(time_s, values, RATE_HZ), strict=True):
        np.testing.assert_array_equal(row, values[time_s <= moment_s + 1e-9][-1])


def test_no_step_depends_on_a_later_sample(jittery):
    time_s, values = jittery
    grid_s, held = hold_on_grid(time_s, values, RATE_HZ)
    for changed in (50, 200, 399):
        others = values.copy()
        others[changed:] += 1000.0
        before = grid_s < time_s[changed] - 1e-6
        shifted = time_s.copy()
        shifted[changed:] += 0.003
        for times_s in (time_s, shifted):
            other_s, other = hold_on_grid(times_s, others, RATE_HZ)
            count = int(before.sum())
            np.testing.assert_array_equal(other_s[:count], grid_s[:count])
            np.testing.assert_array_equal(other[:count], held[:count])


def test_what_is_on_the_grid_already_comes_back():
    time_s = np.cumsum(np.full(5000, 0.1))  # adds up rounding
    values = np.arange(5000.0)[:, None]
    grid_s, held = hold_on_grid(time_s, values, RATE_HZ)
    np.testing.assert_array_equal(held, values)
    np.testing.assert_allclose(grid_s, time_s, atol=1e-9)


def test_one_sample_and_none():
    one_s, one = hold_on_grid(np.array([7.0]), np.array([[1.0, 2.0]]), RATE_HZ)
    assert (one_s.tolist(), one.tolist()) == ([7.0], [[1.0, 2.0]])
    none_s, none = hold_on_grid(np.empty(0), np.empty((0, 2)), RATE_HZ)
    assert (none_s.shape, none.shape) == ((0,), (0, 2))


def write(boat, time_s, name="a.csv"):
    i = np.arange(len(time_s))
    rows = zip(time_s, np.sin(i), 5 + np.cos(i), 0.1 * np.sin(i / 3), strict=True)
    lines = [",".join(map(repr, map(float, row))) for row in rows]
    boat.write(name, "\n".join(["time_s,Rudder,Speed,Heading", *lines, ""]))


def test_a_recording_of_any_higher_rate_is_put_on_the_grid(make_boat):
    boat = make_boat(source=HOLD)
    time_s = np.cumsum(np.random.default_rng(1).uniform(0.1, 0.9, 60))
    write(boat, time_s)
    result = boat.read()
    assert result.findings == []
    (recording,) = result.recordings
    np.testing.assert_allclose(recording.time_s, time_s[0] + np.arange(len(recording.time_s)))
    last = np.searchsorted(time_s, recording.time_s, side="right") - 1
    np.testing.assert_array_equal(recording.values[:, 1], 5 + np.cos(last))
    assert recording.segments == ((0, len(recording.time_s)),)


def test_segments_between_gaps_have_grids_of_their_own(make_boat):
    boat = make_boat(source=HOLD)
    time_s = np.concatenate([np.arange(0, 20, 0.4), np.arange(30.25, 50, 0.4)])
    write(boat, time_s)
    finding = boat.one("a gap")
    assert (finding.severity, finding.row) == ("warning", 52)
    (recording,) = boat.read().recordings
    assert recording.segments == ((0, 20), (20, 40))
    np.testing.assert_array_equal(recording.time_s[:20], np.arange(20.0))
    np.testing.assert_array_equal(recording.time_s[20:], 30.25 + np.arange(20.0))
    np.testing.assert_array_equal(recording.values[20, 1], 5 + np.cos(50))


def test_a_slower_recording_would_be_invented(make_boat):
    boat = make_boat(source=HOLD)
    write(boat, np.arange(0, 60, 1.25))
    finding = boat.one("the recording is slower than rate_hz=1")
    assert (finding.severity, finding.column, finding.value) == ("error", "time_s", "0.8 Hz")
    assert finding.remedy.startswith("lower the case's rate_hz")
    assert boat.read().recordings == []


def test_the_order_of_time_stamps_is_checked_before(make_boat):
    boat = make_boat(source=HOLD)
    time_s = np.arange(0, 60, 0.5)
    time_s[10], time_s[20] = time_s[9], 3.0
    write(boat, time_s)
    assert boat.one("repeated").row == 12
    assert boat.one("goes back").row == 22
    assert boat.read().recordings == []


def test_the_length_is_that_of_the_resampled_recording(make_boat):
    boat = make_boat(source=HOLD)
    write(boat, np.arange(0, 9, 0.25))
    assert boat.one("shorter than one window").value == "9 samples"
    write(boat, np.arange(0, 9.25, 0.25))
    assert boat.read().findings == []


def test_without_resampling_samples_stay_as_they_are_recorded(make_boat):
    boat = make_boat()
    time_s = np.arange(60.0) + np.random.default_rng(1).uniform(-0.2, 0.2, 60)
    write(boat, time_s)
    (recording,) = boat.read().recordings
    np.testing.assert_array_equal(recording.time_s, time_s)


@pytest.mark.parametrize(("recorded_hz", "rate_hz"), [(10, 10), (20, 20), (100, 50)])
def test_seconds_since_1970_come_back_from_the_grid_they_are_on(recorded_hz, rate_hz):
    numbers = np.arange(5000)
    time_s = 1_700_000_000.123 + numbers / recorded_hz
    grid_s, held = hold_on_grid(time_s, numbers[:, None].astype(float), rate_hz)
    every = recorded_hz // rate_hz
    np.testing.assert_array_equal(held[:, 0], numbers[::every])
    np.testing.assert_allclose(grid_s, time_s[::every], rtol=0, atol=1e-6)


def test_a_sample_that_is_held_for_long_is_named(make_boat):
    boat = make_boat(source=HOLD, max_gap_s=5.0)
    write(boat, np.delete(np.arange(0, 60, 0.5), range(21, 27)))
    finding = boat.one("the last sample is held over up to 3.5 s")
    assert (finding.severity, finding.row, finding.value) == ("warning", 23, "3.5")


def test_thinning_keeps_the_held_samples_with_their_own_stamps():
    time_s = np.array([0.0, 0.03, 0.09, 0.11, 0.21, 0.29, 0.52])
    values = np.arange(7.0)[:, None]
    times, kept = thin_to_grid(time_s, values, 10.0)
    assert times.tolist() == [0.0, 0.09, 0.11, 0.29]
    assert kept[:, 0].tolist() == [0, 2, 3, 5]


def test_thinned_increments_over_their_own_time_give_the_true_speed():
    random = np.random.default_rng(2)
    time_s = np.arange(500) * 0.02 + random.uniform(-0.008, 0.008, 500)
    times, position = thin_to_grid(time_s, 1.5 * time_s[:, None], 10.0)
    np.testing.assert_allclose(np.diff(position[:, 0]) / np.diff(times), 1.5)
    held_times, held = hold_on_grid(time_s, 1.5 * time_s[:, None], 10.0)
    assert np.std(np.diff(held[:, 0]) / np.diff(held_times)) > 0.05


def test_a_relative_pose_refuses_held_stamps(boat):
    raw = boat.case.model_dump()
    raw["channels"][0]["role"] = "state"
    raw["pose"] = {"x": "Rudder", "y": "Speed", "heading": ["Heading"], "coordinates": "relative"}
    raw["source"]["resample"] = "thin"
    Case.model_validate(raw)
    raw["source"]["resample"] = "hold"
    with pytest.raises(ValidationError, match="set it to thin"):
        Case.model_validate(raw)
