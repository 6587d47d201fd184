"""Disturbances differ from the undisturbed task where they're labelled, and as declared."""

import numpy as np
import pytest

from odisar.recordings.schema import label_times
from odisar.simulators.robot.drive import drive_task
from odisar.simulators.robot.fleet import plan_fleet
from odisar.simulators.robot.journey import JourneyMaker, footprint_touches
from odisar.simulators.robot.motion import SlipPatch
from odisar.simulators.robot.odometry import true_pose
from odisar.simulators.robot.runs import CHANNELS, _channels, _log, simulate_tasks

SEED = 11
_MINIMUM_S = 180.0


def _yaw(recording):
    return np.unwrap(2.0 * np.arctan2(recording.values[:, 2], recording.values[:, 3]))


@pytest.fixture(scope="module")
def maker(small_robot, office):
    return JourneyMaker(office, small_robot, SEED)


@pytest.fixture(scope="module")
def journeys(small_robot, maker):
    return {
        plan.seed_name: maker.make(plan, plan.strengths[0])
        for plan in plan_fleet(small_robot.fleet)
    }


@pytest.fixture(scope="module")
def sound(small_robot, maker):
    """The seven channels of a task of each kind, before anything disturbs its odometry."""

    def of(kind):
        plan = next(p for p in plan_fleet(small_robot.fleet) if p.disturbance == kind)
        journey = maker.make(plan, plan.strengths[0])
        logged = _log(plan, journey, small_robot, SEED, CHANNELS)
        return np.round(np.stack(_channels(logged.odometry), axis=1), 6)

    return of


def test_every_disturbed_recording_is_labelled_and_no_other(recordings):
    for recording in recordings.values():
        labels = {interval.label for interval in recording.intervals}
        expected = {recording.info.disturbance} if recording.info.is_disturbed else set()
        assert labels == expected


def test_disturbances_come_after_the_first_waypoint_and_leave_quiet_time(small_robot, recordings):
    for recording in recordings.values():
        for interval in recording.intervals:
            first_s = float(recording.info.extra["first_waypoint_s"])
            assert interval.start_s >= first_s - 0.1
            quiet_s = recording.time_s[-1] - interval.end_s
            assert quiet_s > small_robot.disturbances.quiet_s - 1.0


def test_noise_lasts_as_published_from_the_first_waypoint_on(recordings):
    for name, recording in recordings.items():
        if "noise" in name:
            (interval,) = recording.intervals
            first_s = float(recording.info.extra["first_waypoint_s"])
            assert interval.start_s == pytest.approx(first_s, abs=0.15)
            assert interval.end_s - interval.start_s == pytest.approx(80.0, abs=0.15)


def test_strengths_of_a_task_share_their_undisturbed_samples(recordings):
    for stem, strengths in (("test-noise-01", ("1", "0.01")), ("test-bias-01", ("0.1", "0.5"))):
        weak, strong = (recordings[f"{stem}-s{strength}"] for strength in strengths)
        assert weak.intervals == strong.intervals
        np.testing.assert_array_equal(weak.time_s, strong.time_s)
        inside = label_times(weak.time_s, weak.intervals)
        np.testing.assert_array_equal(weak.values[~inside], strong.values[~inside])
        assert (weak.values[inside] != strong.values[inside]).any(axis=1).mean() > 0.99


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("noise", "development-noise-01-s0.1"),
        ("correlated-noise", "test-correlated-noise-01-s0.1"),
        ("bias", "test-bias-01-s0.1"),
        ("drift", "test-drift-01-s0.5"),
    ],
)
def test_labels_cover_what_changed_and_nothing_else(kind, name, sound, recordings):
    recording = recordings[name]
    inside = label_times(recording.time_s, recording.intervals)
    changed = (recording.values != sound(kind)).any(axis=1)
    assert not changed[~inside].any()
    assert changed[inside].mean() > 0.99


def test_noise_has_the_declared_standard_deviation_and_no_mean(sound, recordings):
    recording = recordings["development-noise-01-s0.1"]
    inside = label_times(recording.time_s, recording.intervals)
    clean = sound("noise")
    difference = (recording.values - clean)[inside]
    yaw = np.unwrap(2.0 * np.arctan2(clean[:, 2], clean[:, 3]))
    yaw_noise = np.angle(np.exp(1j * (_yaw(recording) - yaw)[inside]))
    noise = np.column_stack([difference[:, :2], yaw_noise, difference[:, 4:]])
    declared = 0.1 * np.array([0.1, 0.1, 0.05, 0.1, 0.1, 0.1])
    np.testing.assert_allclose(noise.std(axis=0), declared, rtol=0.1)
    assert (np.abs(noise.mean(axis=0)) < 0.15 * declared).all()
    # White: a sample says nothing about the next one.
    assert abs(np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1]) < 0.1


def test_correlated_noise_changes_slowly(sound, recordings):
    recording = recordings["test-correlated-noise-01-s0.1"]
    inside = label_times(recording.time_s, recording.intervals)
    noise = (recording.values - sound("correlated-noise"))[inside, 0]
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] > 0.9
    assert 0.2 < noise.std() / 0.01 < 2.0


@pytest.mark.parametrize("name", ["test-bias-01-s0.5", "test-drift-01-s0.5"])
def test_bias_and_drift_are_in_one_logged_velocity_alone(name, sound, recordings):
    recording = recordings[name]
    inside = label_times(recording.time_s, recording.intervals)
    difference = (recording.values - sound(recording.info.disturbance))[inside]
    channel, size, _ = recording.info.extra["detail"].split()
    column = CHANNELS.index(channel)
    assert not np.delete(difference, column, axis=1).any()
    assert abs(float(size)) == pytest.approx(0.05)
    assert difference[-1, column] == pytest.approx(float(size), abs=1e-4)
    started = 0.0 if "drift" in name else float(size)
    assert difference[0, column] == pytest.approx(started, abs=1e-4)


def test_tasks_last_three_minutes_and_visit_every_waypoint(small_robot, recordings, journeys):
    for recording in recordings.values():
        assert recording.time_s[-1] > _MINIMUM_S - 0.2
    for journey in journeys.values():
        motion = journey.motion
        assert len(motion.arrivals_s) == small_robot.task.waypoints
        for point, arrival_s in zip(journey.task.points[1:], motion.arrivals_s, strict=True):
            step = int(np.argmin(np.abs(motion.time_s - arrival_s)))
            assert np.hypot(*(motion.pose[step, :2] - point)) < 0.15
            assert np.abs(motion.twist[step]).max() < 0.01


def test_waypoints_are_apart_and_clear_of_walls(small_robot, office, journeys):
    for journey in journeys.values():
        points = journey.task.points
        gaps = np.hypot(*(points[:, None] - points[None]).T)[np.triu_indices(len(points), 1)]
        assert gaps.min() >= small_robot.task.separation_m
        assert office.clearance_at(*points.T).min() >= small_robot.task.clearance_m


def test_nothing_is_touched_and_no_limit_exceeded(small_robot, journeys):
    drive = small_robot.drive
    for journey in journeys.values():
        assert not footprint_touches(journey, small_robot)
        gains = np.diff(journey.motion.twist, axis=0) / drive.step_s
        # Coming to rest may take what's left of a speed (5 mm/s) in one step.
        assert np.hypot(*gains[:, :2].T).max() <= drive.acceleration_m_s2 + 1e-9
        assert np.abs(gains[:, 2]).max() <= drive.yaw_acceleration_rad_s2 + 1e-9
        assert np.hypot(*journey.motion.twist[:, :2].T).max() < 1.1 * drive.cruise_m_s.high


def test_a_detour_avoids_the_blockage_and_is_labelled_at_it(small_robot, journeys):
    half_base_m = 0.5 * small_robot.base.width_m
    for name in ("test-blocked-01", "test-blocked-02"):
        journey = journeys[name]
        motion, ((start_s, end_s),) = journey.motion, journey.spans_s
        added = journey.changed.occupied & ~journey.grid.occupied
        assert added.any()
        later = motion.time_s >= journey.changed_s
        assert journey.changed.clearance_at(*motion.pose[later, :2].T).min() > half_base_m
        during = (motion.time_s >= start_s) & (motion.time_s < end_s)
        # It drives up, stands, and is off again.
        speed = np.hypot(*motion.twist[during, :2].T)
        assert speed.min() < 0.01
        assert speed[-1] > 0.1
        # The blockage is on the way that was planned.
        rows, columns = np.nonzero(added)
        middle = (np.array([columns.mean(), rows.mean()]) + 0.5) * journey.grid.resolution_m
        nearest = np.hypot(*(motion.pose[during, :2] - middle).T).min()
        assert nearest < small_robot.disturbances.blocked.stop_m + 0.6


def test_the_base_keeps_away_from_people_and_is_labelled_while_it_does(small_robot, journeys):
    journey = journeys["test-people-01"]
    motion = journey.motion
    assert motion.met
    inside = np.zeros(len(motion.time_s), dtype=bool)
    for start_s, end_s in journey.spans_s:
        inside |= (motion.time_s >= start_s) & (motion.time_s < end_s)
    assert not motion.reacts[~inside].any()
    for crossing, begun_s in motion.met:
        steps = (motion.time_s >= begun_s) & (motion.time_s < begun_s + crossing.gone_s)
        people = np.array([crossing.at(now_s - begun_s) for now_s in motion.time_s[steps]])
        gaps = np.hypot(*(motion.pose[steps, :2] - people).T)
        assert gaps.min() > small_robot.disturbances.people.radius_m + 0.25


def test_slip_moves_the_base_less_than_its_wheels_count(recordings, journeys):
    journey = journeys["test-slip-01"]
    recording = recordings["test-slip-01-s1"]
    start_s, end_s = journey.spans_s[0]
    assert recording.intervals[0].start_s == pytest.approx(start_s, abs=0.15)
    steps = (recording.time_s >= start_s) & (recording.time_s < end_s)
    counted_m = np.hypot(*np.diff(recording.values[steps, :2], axis=0).T).sum()
    real = true_pose(journey.motion, recording.time_s[steps])
    real_m = np.hypot(*np.diff(real[:, :2], axis=0).T).sum()
    assert real_m < 0.8 * counted_m
    assert not journey.motion.slips[journey.motion.time_s < start_s].any()
    before = recording.time_s < start_s
    np.testing.assert_allclose(
        recording.values[before, :2],
        true_pose(journey.motion, recording.time_s[before])[:, :2],
        atol=0.8,
    )


def test_motion_is_the_same_until_the_slippery_patch(small_robot, journeys):
    journey = journeys["test-slip-01"]
    without = drive_task(journey.task, journey.legs, journey.wheels, small_robot)
    nowhere = drive_task(
        journey.task,
        journey.legs,
        journey.wheels,
        small_robot,
        patch=SlipPatch((-50.0, -50.0), 1.0, 0.5, (0.1, 0.1), 0.1),
    )
    np.testing.assert_array_equal(without.pose, nowhere.pose)
    steps = int(journey.spans_s[0][0] / small_robot.drive.step_s)
    np.testing.assert_array_equal(without.pose[:steps], journey.motion.pose[:steps])


def test_leaving_tasks_out_changes_no_other(small_robot, recordings):
    plan = next(p for p in plan_fleet(small_robot.fleet) if p.disturbance == "people")
    (alone,) = simulate_tasks([plan], small_robot, SEED, CHANNELS)
    np.testing.assert_array_equal(alone.values, recordings[alone.name].values)
