import numpy as np
import pytest
import torch

from odisar.recordings.schema import Recording, RecordingInfo
from odisar.windows.coordinates import (
    PoseChannels,
    features,
    moved_from,
    pose_rates,
    relative_to,
    wrap_angle,
)
from odisar.windows.scaling import Scaler
from odisar.windows.targets import horizon_targets, recorded_states
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import WindowSpec

#: x, y, heading [rad], and a speed that is no part of the pose.
ANGLE = PoseChannels(x=0, y=1, heading=(2,), in_degrees=False)
SPEC = WindowSpec(8, 4, outputs=(0, 1, 3), commands=(), known_ahead=(), pose=ANGLE)


def circle(samples=60, turn_rad_s=0.5, speed=1.0, jitter=0.0, segments=()):
    """Return a drive round a circle, at the pose of each (jittered) stamp."""
    random = np.random.default_rng(3)
    time_s = np.arange(samples) * 0.1 + random.uniform(-jitter, jitter, samples)
    heading = turn_rad_s * time_s
    radius = speed / turn_rad_s
    values = np.column_stack(
        [
            40 + radius * np.sin(heading),
            -7 + radius * (1 - np.cos(heading)),
            wrap_angle(heading),
            np.full(samples, speed) + 0.01 * random.normal(size=samples),
        ]
    )
    return Recording("circle", RecordingInfo("robot"), time_s, values, segments=segments)


def test_rates_are_those_of_the_body_whatever_the_stamps_do():
    recording = circle(jitter=0.03)
    rates = pose_rates(recording.time_s, ANGLE.read(recording.values))
    assert np.isnan(rates[0]).all()
    np.testing.assert_allclose(rates[1:], [[1.0, 0.0, 0.5]] * 59, atol=1e-3)


def test_features_start_anew_after_a_gap():
    recording = circle(segments=((0, 30), (30, 60)))
    seen = features(recording, ANGLE)
    assert seen.shape == (60, 4)
    assert np.flatnonzero(np.isnan(seen).any(axis=1)).tolist() == [0, 30]
    assert np.array_equal(seen[:, 3], recording.values[:, 3])


def test_relative_and_moved_from_are_inverse():
    random = np.random.default_rng(1)
    origin, pose = random.uniform(-3, 3, (2, 50, 3))
    np.testing.assert_allclose(moved_from(origin, relative_to(pose, origin)), pose, atol=1e-12)


def test_targets_are_the_displacement_in_the_frame_of_the_last_pose():
    recording = circle()
    targets = horizon_targets(recording.values, np.array([20, 40]), SPEC)
    turned = 0.5 * 0.1 * np.arange(1, 5)
    expected = np.column_stack([2 * np.sin(turned), 2 * (1 - np.cos(turned))])
    np.testing.assert_allclose(targets[0, :, :2], expected, atol=1e-9)
    np.testing.assert_allclose(targets[1, :, :2], expected, atol=1e-9)
    np.testing.assert_array_equal(targets[0, :, 2], recording.values[21:25, 3])


def test_targets_beyond_the_end_are_not_known():
    targets = horizon_targets(circle().values, np.array([57]), SPEC)
    assert np.isnan(targets[0]).any(axis=1).tolist() == [False, False, True, True]


@pytest.mark.parametrize(
    "pose",
    [
        ANGLE,
        PoseChannels(x=0, y=1, heading=(2,), in_degrees=True),
        PoseChannels(x=0, y=1, heading=(2, 3), in_degrees=False),
    ],
)
def test_targets_go_back_to_the_recorded_states(pose):
    base = circle()
    yaw = base.values[:, 2]
    heading = [np.rad2deg(yaw)] if pose.in_degrees else [yaw]
    if len(pose.heading) == 2:
        heading = [np.sin(yaw / 2), np.cos(yaw / 2)]
    values = np.column_stack([base.values[:, :2], *heading])
    recording = Recording("r", base.info, base.time_s, values)
    spec = WindowSpec(8, 4, tuple(range(values.shape[1])), (), (), pose)
    positions = np.array([10, 30, 50])
    back = recorded_states(horizon_targets(values, positions, spec), recording, positions, spec)
    expected = values[positions[:, None] + np.arange(1, 5)]
    np.testing.assert_allclose(back[..., :2], expected[..., :2], atol=1e-9)
    turned = pose.read(back)[..., 2] - pose.read(expected)[..., 2]
    np.testing.assert_allclose(wrap_angle(turned), 0, atol=1e-9)


def test_windows_of_a_moved_and_turned_recording_are_the_same():
    recording = circle()
    pose = ANGLE.read(recording.values)
    elsewhere = moved_from(np.array([3.0, -90.0, 2.0]), pose)
    moved = Recording(
        "moved",
        recording.info,
        recording.time_s,
        np.column_stack([ANGLE.write(elsewhere), recording.values[:, 3]]),
    )
    scaler = Scaler.fit([recording], SPEC)
    every = torch.arange(len(WindowSet([recording], scaler, SPEC)))
    here = WindowSet([recording], scaler, SPEC).gather(every)
    there = WindowSet([moved], scaler, SPEC).gather(every)
    torch.testing.assert_close(here.context, there.context, atol=2e-3, rtol=0)
    torch.testing.assert_close(here.truth, there.truth, atol=1e-5, rtol=0)


def test_no_window_holds_the_sample_without_an_increment():
    recording = circle(segments=((0, 30), (30, 60)))
    windows = WindowSet([recording], Scaler.fit([recording], SPEC), SPEC)
    assert len(windows) == 2 * (30 - 1 - 11)
    batch = windows.gather(torch.arange(len(windows)))
    assert torch.isfinite(batch.context).all()
    assert torch.isfinite(batch.truth).all()


def test_scaled_targets_have_unit_spread_on_training_recordings():
    recording = circle(samples=400)
    recording.values[:, 0] += np.random.default_rng(0).normal(scale=0.3, size=400)
    scaler = Scaler.fit([recording], SPEC)
    windows = WindowSet([recording], scaler, SPEC, stride_steps=4)
    truth = windows.gather(torch.arange(len(windows))).truth
    np.testing.assert_allclose(truth.std(dim=(0, 1), correction=0), 1, atol=1e-3)
    np.testing.assert_allclose(truth.mean(dim=(0, 1)), 0, atol=1e-3)
