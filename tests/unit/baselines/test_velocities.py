from dataclasses import replace

import numpy as np
import pytest

from odisar.baselines.velocities import (
    NoVelocityError,
    Velocity,
    compare_pose,
    has_velocity_candidates,
    segment_samples,
)
from small_reference import (
    changed,
    drive_case,
    drive_reference,
    make_drive,
    reference_of,
    system_case,
    system_reference,
)

VELOCITIES = (4, 5, 6)


def drives(change, case=None):
    """Return a reference of drives whose values (sample, channel) are changed."""
    recordings = [make_drive(f"train-{i}") for i in range(6)]
    recordings = [changed(recording, change(recording.values.copy())) for recording in recordings]
    return reference_of(case or drive_case(), recordings, recordings[:1])


def test_each_rate_finds_its_velocity():
    found = compare_pose(drive_reference()).velocities
    assert found == {rate: Velocity(at, 1.0, is_mean=False) for rate, at in enumerate(VELOCITIES)}


def test_velocities_are_told_by_what_they_do_not_by_where_they_stand():
    def swap(values):
        return values[:, [0, 1, 2, 3, 5, 6, 4]]

    found = compare_pose(drives(swap)).velocities
    assert {rate: velocity.channel for rate, velocity in found.items()} == {0: 6, 1: 4, 2: 5}


def test_a_velocity_of_an_interval_s_ends_is_taken_as_their_mean():
    def at_the_ends(values):
        # Chosen so that the mean of both ends is what the pose moved by.
        ends = values[:, VELOCITIES].copy()
        for i in range(1, len(ends)):
            ends[i] = 2 * values[i, VELOCITIES] - ends[i - 1]
        values[:, VELOCITIES] = ends
        return values

    found = compare_pose(drives(at_the_ends)).velocities
    assert all(velocity.is_mean for velocity in found.values())


def test_a_yaw_rate_in_degrees_counts_in_radians():
    case = drive_case()
    channels = [*case.channels[:6], case.channels[6].model_copy(update={"unit": "deg/s"})]

    def in_degrees(values):
        values[:, 6] = np.rad2deg(values[:, 6])
        return values

    reference = drives(in_degrees, case.model_copy(update={"channels": channels}))
    assert compare_pose(reference).velocities[2] == Velocity(6, float(np.deg2rad(1)), is_mean=False)


@pytest.mark.parametrize("factor", [0.7, 1.4, -1.0])
def test_a_channel_that_goes_otherwise_is_no_velocity(factor):
    def stretch(values):
        values[:, 4] *= factor
        return values

    assert set(compare_pose(drives(stretch)).velocities) == {1, 2}


def test_without_any_velocity_there_is_no_comparison():
    random = np.random.default_rng(2)

    def unrelated(values):
        values[:, VELOCITIES] = random.normal(size=(len(values), 3))
        return values

    with pytest.raises(NoVelocityError, match="one to one"):
        compare_pose(drives(unrelated))


def test_a_channel_that_never_changes_is_no_velocity():
    def still(values):
        values[:, VELOCITIES] = 0.0
        return values

    with pytest.raises(NoVelocityError):
        compare_pose(drives(still))


def test_without_a_relative_pose_there_is_no_comparison():
    with pytest.raises(NoVelocityError, match="no relative pose"):
        compare_pose(system_reference())


def test_residuals_are_rates_less_velocities_and_the_first_is_unknown():
    comparison = compare_pose(drive_reference())
    (time_s, values), *_ = segment_samples([make_drive("scored", noise_m=0.0)])
    biased = values.copy()
    biased[:, VELOCITIES] -= [0.1, 0.2, 0.3]
    residuals = comparison.residuals(time_s, biased)
    assert np.isnan(residuals[0]).all()
    np.testing.assert_allclose(residuals[1:], [[0.1, 0.2, 0.3]] * (len(values) - 1), atol=1e-9)


def test_segments_are_read_apart():
    recording = make_drive("parted")
    parted = changed(recording, recording.values, ((0, 50), (60, 200)))
    found = segment_samples([parted, make_drive("whole", 30)])
    assert [len(time_s) for time_s, _ in found] == [50, 140, 30]
    assert found[1][0][0] == recording.time_s[60]


def test_only_states_beside_a_relative_pose_can_be_velocities():
    case = drive_case()
    assert has_velocity_candidates(case)
    assert not has_velocity_candidates(system_case())
    alone = case.model_copy(update={"channels": case.channels[:4]})
    assert not has_velocity_candidates(alone)
    absolute = case.pose.model_copy(update={"coordinates": "absolute"})
    assert not has_velocity_candidates(case.model_copy(update={"pose": absolute}))


def test_gaps_between_segments_are_no_intervals():
    reference = drive_reference()
    jump = make_drive("jump")
    values = jump.values.copy()
    values[100:, 0] += 50.0
    parted = changed(jump, values, ((0, 100), (100, 200)))
    found = compare_pose(replace(reference, train=[parted])).velocities
    assert set(found) == {0, 1, 2}
