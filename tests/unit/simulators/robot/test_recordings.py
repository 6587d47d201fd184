"""What a recording of the simulated robot is: its bytes, stamps, channels and split."""

import hashlib
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from odisar.errors import OdisarError
from odisar.recordings.reader import read_case
from odisar.recordings.writer import write_recordings
from odisar.simulators.robot import CHANNELS, RANGE_CHANNELS, simulate_robot
from odisar.simulators.robot.fleet import plan_fleet
from odisar.simulators.robot.runs import simulate_tasks

SEED = 11


def _digests(folder, recordings, channels):
    files = write_recordings(folder, recordings, channels)
    return [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]


def test_the_shipped_fleet_has_the_planned_sizes(robot):
    plans = plan_fleet(robot.fleet)
    clean = Counter(plan.split for plan in plans if plan.disturbance == "none")
    assert clean == {
        "train": 24, "validation": 8, "calibration": 75, "development": 8, "test": 40
    }  # fmt: skip
    made = Counter()
    for plan in plans:
        if plan.disturbance != "none":
            made[plan.split, plan.disturbance] += len(plan.recordings)
    assert made == {
        ("development", "noise"): 24,
        ("development", "correlated-noise"): 16,
        ("development", "bias"): 8,
        ("test", "noise"): 100,
        ("test", "correlated-noise"): 20,
        ("test", "bias"): 20,
        ("test", "drift"): 20,
        ("test", "slip"): 10,
        ("test", "blocked"): 10,
        ("test", "people"): 10,
    }


def test_names_are_unique_and_say_what_a_recording_is(robot):
    names = [name for plan in plan_fleet(robot.fleet) for name, _ in plan.recordings]
    assert len(set(names)) == len(names)
    assert {
        "calibration-017",
        "test-clean-040",
        "test-noise-03-s0.1",
        "test-noise-20-s0.005",
        "test-blocked-10",
        "development-noise-08-s0.01",
    } <= set(names)


def test_the_same_seed_writes_the_same_bytes(small_robot, recordings, tmp_path):
    plans = plan_fleet(small_robot.fleet)
    chosen = [plans[0], plans[-1]]
    again = list(simulate_tasks(chosen, small_robot, SEED, CHANNELS))
    first = [recordings[recording.name] for recording in again]
    digests = _digests(tmp_path / "a", first, CHANNELS)
    assert digests == _digests(tmp_path / "b", again, CHANNELS)


def test_another_seed_gives_another_task(small_robot, recordings):
    plan = plan_fleet(small_robot.fleet)[0]
    (other,) = simulate_tasks([plan], small_robot, SEED + 1, CHANNELS)
    assert not np.array_equal(other.values[:100], recordings[other.name].values[:100])


def test_written_recordings_are_read_back_without_a_finding(recordings, robot_case, tmp_path):
    write_recordings(tmp_path / robot_case.source.folder, recordings.values(), CHANNELS)
    case_recordings = read_case("robot", robot_case, tmp_path)
    assert not case_recordings.findings
    for recording in case_recordings.recordings:
        made = recordings[recording.name]
        np.testing.assert_allclose(recording.values, made.values, atol=1e-9)
        assert recording.intervals == made.intervals
        assert len(recording.segments) == 1


def test_stamps_rise_by_half_to_one_and_a_half_periods(recordings):
    for recording in recordings.values():
        steps_s = np.diff(recording.time_s)
        assert recording.time_s[0] == 0.0
        assert steps_s.min() > 0.05
        assert steps_s.max() < 0.15
        assert 0.001 < steps_s.std() < 0.01
        np.testing.assert_array_equal(recording.time_s, np.round(recording.time_s, 6))


def test_orientation_is_a_unit_quaternion_that_never_jumps(recordings):
    for recording in recordings.values():
        quaternion = recording.values[:, 2:4]
        np.testing.assert_allclose(np.hypot(*quaternion.T), 1.0, atol=2e-6)
        if not recording.info.is_disturbed:
            assert np.abs(np.diff(quaternion, axis=0)).max() < 0.08


def test_pose_increments_are_the_integrated_velocity(recordings):
    for name in ("train-001", "test-clean-002"):
        x, y, z, w, vx, vy, _ = recordings[name].values.T
        steps_s = np.diff(recordings[name].time_s)
        yaw = np.unwrap(2.0 * np.arctan2(z, w))
        middle = 0.5 * (yaw[1:] + yaw[:-1])
        ahead = np.diff(x) * np.cos(middle) + np.diff(y) * np.sin(middle)
        aside = np.diff(y) * np.cos(middle) - np.diff(x) * np.sin(middle)
        difference = np.hypot(ahead - vx[1:] * steps_s, aside - vy[1:] * steps_s)
        assert np.sqrt(np.mean(difference**2)) < 0.0005
        # Divided by the nominal period, jitter alone would be ten times as large.
        nominal = np.hypot(ahead - vx[1:] * 0.1, aside - vy[1:] * 0.1)
        assert np.sqrt(np.mean(nominal**2)) > 3.0 * np.sqrt(np.mean(difference**2))


def test_metadata_says_what_was_done(recordings):
    info = recordings["test-noise-02-s0.01"].info
    assert (info.case, info.maneuver, info.disturbance) == ("robot", "waypoint", "noise")
    assert (info.components, info.strength, info.split) == ("all", 0.01, "test")
    assert info.base_seed == recordings["test-noise-02-s1"].info.base_seed == "test-noise-02"
    assert recordings["test-blocked-01"].info.strength is None
    assert recordings["train-001"].info.components == "none"
    assert recordings["test-bias-01-s0.5"].info.extra["detail"]


def test_an_unknown_channel_is_refused_with_what_can_be_made(small_robot):
    with pytest.raises(OdisarError, match=r"no channel 'Range 16'.*position_x.*Range 15"):
        simulate_robot(small_robot, SEED, [*CHANNELS, "Range 16"])


def test_channels_come_in_the_order_asked_for(small_robot, recordings):
    plan = plan_fleet(small_robot.fleet)[0]
    names = ["angular_velocity_z", "position_x"]
    (made,) = simulate_tasks([plan], small_robot, SEED, names)
    np.testing.assert_array_equal(made.values, recordings[made.name].values[:, [6, 0]])


@pytest.mark.parametrize("kind", ["none", "noise", "blocked", "people"])
def test_asking_for_ranges_changes_nothing_else(kind, small_robot, recordings):
    plan = next(p for p in plan_fleet(small_robot.fleet) if p.disturbance == kind)
    made = next(iter(simulate_tasks([plan], small_robot, SEED, [*CHANNELS, *RANGE_CHANNELS])))
    plain = recordings[made.name]
    np.testing.assert_array_equal(made.values[:, :7], plain.values)
    assert replace(made, values=plain.values).intervals == plain.intervals
    ranges = made.values[:, 7:]
    assert ranges.shape[1] == 16
    assert ranges.min() > 0.2
    assert ranges.max() <= small_robot.ranges.max_m
    assert ranges.std() > 0.5


def test_a_late_stamp_that_would_leave_its_period_is_refused(robot):
    odometry = robot.odometry.model_dump()
    odometry["late_s"] = {"low": 0.01, "high": 0.04}
    with pytest.raises(ValueError, match="half a period"):
        type(robot.odometry).model_validate(odometry)


def test_a_door_too_narrow_for_the_planner_is_refused(robot):
    raw = robot.model_dump()
    raw["office"]["door_m"]["low"] = 0.7
    with pytest.raises(ValueError, match=r"door_m\.low=0\.7.*raise it"):
        type(robot).model_validate(raw)
