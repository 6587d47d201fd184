from dataclasses import replace

import numpy as np
import pytest

from odisar.baselines.physics_checks import PoseVelocity, RateOfChange, Stuck
from odisar.baselines.velocities import NoVelocityError
from odisar.errors import OdisarError
from odisar.recordings.schema import Recording
from small_reference import (
    CONTEXT,
    changed,
    drive_case,
    drive_reference,
    make_drive,
    reference_of,
    system_case,
    system_reference,
)
from small_system import make_recording

FIRST = CONTEXT - 1


def system_of(states: np.ndarray, segments=()) -> Recording:
    """Return a recording of the small system with these (sample, 2) states."""
    base = make_recording("made", len(states))
    return changed(base, np.column_stack([base.values[:, 0], states]), segments)


def fitted(detector, reference):
    detector.fit(reference)
    return detector


@pytest.mark.parametrize("check", [PoseVelocity, RateOfChange, Stuck])
def test_nothing_is_scored_before_it_is_fitted(check):
    with pytest.raises(OdisarError, match=rf"{check.__name__}.*fit\(\)"):
        check().score([make_drive("early")])


# Pose against velocity -----------------------------------------------------------------------


def exact_drives(bias):
    """Return a reference whose held-out drive differs from its velocities by ``bias`` (3,)."""
    reference = drive_reference()
    held_out = make_drive("held-out", noise_m=0.0)
    values = held_out.values.copy()
    values[:, 4:] -= bias
    return replace(reference, held_out=[changed(held_out, values)])


def biased_drive(bias, start=0):
    drive = make_drive("scored", noise_m=0.0)
    values = drive.values.copy()
    values[start:, 4:] -= bias
    return changed(drive, values)


def test_pose_and_velocity_agree_in_units_of_the_usual_difference():
    check = fitted(PoseVelocity(), exact_drives([0.01, 0.02, 0.04]))
    exact, biased = check.score([biased_drive(0.0), biased_drive([0.02, 0.02, 0.2])])
    np.testing.assert_allclose(exact[CONTEXT:], 1.0, atol=1e-6)
    np.testing.assert_allclose(biased[CONTEXT:], 1 + 5.0, rtol=1e-6)  # the rate about: 0.2 / 0.04


def test_the_difference_is_a_mean_over_the_persistence():
    check = fitted(PoseVelocity(), exact_drives([0.01, 0.01, 0.01]))
    scores = check.score([biased_drive([0.05, 0.0, 0.0], start=100)])[0]
    # 0.5 s at 10 Hz: a fifth of the five usual differences joins with each sample.
    np.testing.assert_allclose(scores[99:107], 1 + np.array([0, 1, 2, 3, 4, 5, 5, 5]), atol=1e-6)


def test_without_a_velocity_the_check_does_not_exist():
    with pytest.raises(NoVelocityError):
        PoseVelocity().fit(system_reference())


# Rate of change ------------------------------------------------------------------------------


def ramps(step_speed, step_turn, samples=60):
    count = np.arange(samples, dtype=float)
    return np.column_stack([step_speed * count, step_turn * count])


def test_the_largest_change_of_a_state_counts_in_units_of_the_usual():
    train = [system_of(ramps(0.5, 0.1))]
    check = fitted(RateOfChange(), reference_of(system_case(), train, train))
    scores = check.score([system_of(ramps(1.0, -0.4))])[0]
    np.testing.assert_allclose(scores[FIRST:], 1 + 4.0)


def test_the_usual_change_is_what_all_but_one_in_a_thousand_stay_below():
    speed = np.cumsum(np.where(np.arange(4001) % 2000 == 1000, 50.0, 0.5))
    train = [system_of(np.column_stack([speed, np.arange(4001.0)]))]
    check = fitted(RateOfChange(), reference_of(system_case(), train, train))
    np.testing.assert_allclose(np.nanmax(check.score(train)[0]), 1 + 100.0)


def test_commands_may_change_as_they_like():
    train = [system_of(ramps(0.5, 0.1))]
    check = fitted(RateOfChange(), reference_of(system_case(), train, train))
    values = train[0].values.copy()
    values[:, 0] = np.where(np.arange(len(values)) % 2, 1e3, -1e3)
    before, after = check.score([train[0], changed(train[0], values)])
    np.testing.assert_array_equal(before, after)


def test_a_wrapping_heading_is_no_change():
    case = drive_case()
    absolute = case.pose.model_copy(update={"coordinates": "absolute"})
    train = [make_drive("train")]
    reference = reference_of(case.model_copy(update={"pose": absolute}), train, train)
    values = train[0].values.copy()
    values[100:, 2:4] *= -1.0  # the same heading, as the quaternion's other sign
    check = fitted(RateOfChange(), reference)
    before, after = check.score([train[0], changed(train[0], values)])
    np.testing.assert_array_equal(before, after)


# Stuck ---------------------------------------------------------------------------------------


def stuck_reference(longest_steps=4):
    """Return a reference in which both states change at every step but for one run."""
    states = ramps(0.5, 0.5)
    states[30 : 30 + longest_steps] = states[30]
    train = [system_of(states)]
    return reference_of(system_case(), train, train)


def test_a_run_counts_in_units_of_the_longest_on_train():
    check = fitted(Stuck(), stuck_reference())
    states = ramps(1.0, 1.0)
    states[40:50, 1] = states[40, 1]
    scores = check.score([system_of(states)])[0]
    expected = np.full(60, 0.25)  # one step of four
    expected[40:50] = np.arange(1, 11) / 4
    np.testing.assert_allclose(scores[FIRST:], expected[FIRST:])


def test_a_change_finer_than_any_on_train_is_none():
    check = fitted(Stuck(), stuck_reference())
    states = ramps(1.0, 1.0)
    states[40:, 1] = states[40, 1] + 0.2 * (np.arange(20) % 2)
    assert check.score([system_of(states)])[0][-1] == pytest.approx(20 / 4)


def test_a_channel_moving_by_its_resolution_is_not_stuck():
    check = fitted(Stuck(), stuck_reference())
    scores = check.score([system_of(ramps(0.5, 0.5))])[0]
    np.testing.assert_allclose(scores[FIRST:], 0.25)


def test_rounding_is_no_resolution():
    reference = stuck_reference()
    rounded = reference.train[0].values.copy()
    rounded[31, 1:] += 1e-15  # the run goes on all the same
    check = fitted(Stuck(), replace(reference, train=[changed(reference.train[0], rounded)]))
    states = ramps(1.0, 1.0)
    states[40:50, 1] = states[40, 1]
    assert check.score([system_of(states)])[0][49] == pytest.approx(10 / 4)


def test_a_state_that_never_moves_on_train_is_not_stuck_until_it_has_been_for_longer():
    states = np.column_stack([np.arange(60.0), np.zeros(60)])
    train = [system_of(states)]
    check = fitted(Stuck(), reference_of(system_case(), train, train))
    longer = np.column_stack([np.arange(90.0), np.zeros(90)])
    assert check.score([system_of(longer)])[0][-1] == pytest.approx(90 / 60)


def test_a_run_ends_with_a_gap():
    check = fitted(Stuck(), stuck_reference())
    still = system_of(np.ones((80, 2)), ((0, 40), (40, 80)))
    scores = check.score([still])[0]
    np.testing.assert_allclose(scores[[39, 79]], 40 / 4)
