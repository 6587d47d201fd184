"""What a recording of the simulated ferry is: its bytes, its labels, its channels."""

import hashlib

import numpy as np
import pytest

from odisar.recordings.writer import write_recordings
from odisar.simulators.vessel.fleet import plan_fleet
from odisar.simulators.vessel.runs import CHANNELS, simulate_runs, simulate_vessel

SEED = 11


@pytest.fixture(scope="module")
def recordings(small_vessel):
    return {recording.name: recording for recording in simulate_vessel(small_vessel, SEED)}


def _values(recordings, name, channel):
    return recordings[name].values[:, CHANNELS.index(channel)]


def test_the_same_seed_writes_the_same_bytes(small_vessel, tmp_path):
    plans = plan_fleet(small_vessel)[:4]
    digests = []
    for name in ("first", "second"):
        files = write_recordings(
            tmp_path / name, simulate_runs(plans, small_vessel, SEED), CHANNELS
        )
        digests.append([hashlib.sha256(file.read_bytes()).hexdigest() for file in files])
    assert digests[0] == digests[1]


def test_another_seed_gives_other_values(small_vessel, recordings):
    plan = plan_fleet(small_vessel)[0]
    (other,) = simulate_runs([plan], small_vessel, SEED + 1)
    assert not np.array_equal(other.values, recordings[plan.name].values)


def test_a_run_does_not_depend_on_the_runs_beside_it(small_vessel, recordings):
    plans = plan_fleet(small_vessel)
    for plan in (plans[0], plans[-1]):
        (alone,) = simulate_runs([plan], small_vessel, SEED)
        np.testing.assert_array_equal(alone.values, recordings[plan.name].values)


@pytest.mark.parametrize("left_out", ["clean", "one_component"])
def test_leaving_runs_out_changes_no_other_recording(small_vessel, recordings, left_out):
    fleet = small_vessel.fleet.model_copy(update={left_out: {}})
    fewer = list(simulate_vessel(small_vessel.model_copy(update={"fleet": fleet}), SEED))
    assert 0 < len(fewer) < len(recordings)
    for recording in fewer:
        np.testing.assert_array_equal(recording.values, recordings[recording.name].values)


def test_a_recording_has_a_sample_a_second(small_vessel, recordings):
    for recording in recordings.values():
        assert recording.values.shape == (small_vessel.duration_s, len(CHANNELS))
        np.testing.assert_array_equal(recording.time_s, np.arange(small_vessel.duration_s))
        assert np.isfinite(recording.values).all()


def test_only_disturbed_recordings_have_an_interval_near_minutes_7_to_14(small_vessel, recordings):
    event = small_vessel.event
    for recording in recordings.values():
        if not recording.info.is_disturbed:
            assert recording.intervals == ()
            continue
        (interval,) = recording.intervals
        assert abs(interval.start_s - event.onset_s) <= event.jitter_s
        assert abs(interval.end_s - event.end_s) <= event.jitter_s
        assert interval.label == recording.info.disturbance


def test_strengths_of_one_run_are_equal_until_the_onset(recordings):
    weak = recordings["test-zigzag-20-case-3-s0.1"]
    strong = recordings["test-zigzag-20-case-3-s1"]
    onset = int(weak.intervals[0].start_s)
    assert weak.intervals == strong.intervals
    np.testing.assert_array_equal(weak.values[: onset + 1], strong.values[: onset + 1])
    assert not np.array_equal(weak.values[onset + 30 :], strong.values[onset + 30 :])


def test_case_1_and_case_3_are_not_the_same_run(recordings):
    first = recordings["test-turning-30-case-1-s1"].info
    third = recordings["test-turning-30-case-3-s1"].info
    assert first.base_seed != third.base_seed
    assert first.extra["heading_deg"] != third.extra["heading_deg"]


def test_a_steady_turn_to_one_side_keeps_the_sign_of_the_yaw_rate(recordings):
    for replicate in (1, 2):
        name = f"train-turning-30-{replicate}"
        angle = _values(recordings, name, "Rudder Angle")[120:]
        yaw_rate = _values(recordings, name, "Yaw Rate")[120:]
        assert set(np.abs(angle)) == {30.0}
        assert np.all(np.sign(yaw_rate) == -np.sign(angle))


def test_a_zigzag_orders_only_its_own_angle_to_both_sides(recordings):
    angle = _values(recordings, "train-zigzag-20-1", "Rudder Angle")
    assert set(angle[60:]) == {-20.0, 20.0}
    assert 10 <= np.count_nonzero(np.diff(angle[60:])) <= 40


def test_random_steering_stays_within_its_angle(small_vessel, recordings):
    angle = _values(recordings, "train-random-high-1", "Rudder Angle")
    assert np.abs(angle).max() <= small_vessel.maneuvers.random["high"].max_angle_deg
    assert len(set(angle)) > 10


def test_roll_rate_is_the_rate_of_the_roll_angle(recordings):
    roll = _values(recordings, "test-zigzag-20-case-3-s1", "Roll Angle")
    rate = _values(recordings, "test-zigzag-20-case-3-s1", "Roll Rate")
    assert np.corrcoef(np.gradient(roll), rate)[0, 1] > 0.9


def test_velocities_through_the_water_leave_the_current_out(small_vessel):
    plan = next(
        p for p in plan_fleet(small_vessel) if p.name == "test-turning-30-case-3-current-s0.5"
    )
    through = small_vessel.model_copy(update={"velocities": "through-water"})
    (ground,) = simulate_runs([plan], small_vessel, SEED)
    (water,) = simulate_runs([plan], through, SEED)
    event = slice(int(ground.intervals[0].start_s) + 60, int(ground.intervals[0].end_s) - 60)
    surge = CHANNELS.index("Surge Speed")
    assert np.ptp(water.values[event, surge]) < 0.5 * np.ptp(ground.values[event, surge])


def test_clean_runs_are_calm_or_light(recordings):
    roll_limit_deg, drift_limit_m_s = 4.0, 1.2
    weather = [r.info.extra["weather"] for r in recordings.values() if not r.info.is_disturbed]
    assert weather.count("light") == weather.count("calm") == 3
    for name, recording in recordings.items():
        if not recording.info.is_disturbed:
            assert np.abs(_values(recordings, name, "Roll Angle")).max() < roll_limit_deg
            assert np.abs(_values(recordings, name, "Sway Speed")).max() < drift_limit_m_s
