"""Persistence and constant velocity, on motions whose future is known in closed form."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from odisar.errors import OdisarError
from odisar.forecasters.constant_velocity import ConstantVelocity
from odisar.forecasters.persistence import Persistence
from odisar.recordings.schema import Recording, RecordingInfo
from odisar.windows.coordinates import PoseChannels
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import WindowSpec

RATE_HZ = 10.0
ANGLE = PoseChannels(x=0, y=1, heading=(2,), in_degrees=True)
QUATERNION = PoseChannels(x=0, y=1, heading=(2, 3), in_degrees=False)


def circling(turn: float, pose: PoseChannels, samples: int = 120) -> Recording:
    """Return a body at 0.6 m/s ahead and 0.2 m/s aside that turns at a constant rate."""
    time_s = np.arange(samples) / RATE_HZ
    heading = 0.4 + turn * time_s
    radius = np.array([0.6, 0.2]) / turn
    x = radius[0] * np.sin(heading) + radius[1] * np.cos(heading)
    y = -radius[0] * np.cos(heading) + radius[1] * np.sin(heading)
    pose_values = np.zeros((samples, 5))
    pose_values[:, list(pose.positions)] = pose.write(np.column_stack([x, y, heading]))
    pose_values[:, 4] = np.sin(time_s)
    return Recording(f"turn {turn}", RecordingInfo("body"), time_s, pose_values)


def pose_windows(pose: PoseChannels) -> tuple[WindowSet, Scaler, WindowSpec]:
    recordings = [circling(turn, pose) for turn in (0.3, -0.8, 1.1)]
    spec = WindowSpec(8, 12, (*pose.positions, 4), (), (), pose)
    scaler = Scaler.fit(recordings, spec)
    return WindowSet(recordings, scaler, spec), scaler, spec


def state_windows(values: np.ndarray, outputs=(1, 2)) -> tuple[WindowSet, Scaler, WindowSpec]:
    info = RecordingInfo("states")
    recording = Recording("states", info, np.arange(len(values), dtype=float), values)
    spec = WindowSpec(10, 6, outputs, (), ())
    scaler = Scaler.fit([recording], spec)
    return WindowSet([recording], scaler, spec), scaler, spec


def every_window(windows: WindowSet):
    return windows.gather(torch.arange(len(windows)))


def constant_velocity(scaler, spec, steps=(1, 3), dampings=(0.0, 0.5, 1.0)) -> ConstantVelocity:
    return ConstantVelocity(scaler, spec, RATE_HZ, steps, dampings)


def test_persistence_holds_every_state_at_its_last_value():
    values = np.random.default_rng(0).normal(size=(60, 3)) * [1, 5, 0.1] + [0, 3, 7]
    windows, scaler, spec = state_windows(values)
    batch = every_window(windows)
    forecast = Persistence(scaler, spec).forecast(batch.context, batch.known_future)
    physical = scaler.unscale_targets(forecast.numpy())
    last = values[windows.issues.numpy()][:, None, 1:]
    np.testing.assert_allclose(physical, np.broadcast_to(last, physical.shape), rtol=1e-5)


@pytest.mark.parametrize("pose", [ANGLE, QUATERNION])
def test_persistence_of_a_relative_pose_stands_still_and_holds_the_rest(pose):
    windows, scaler, spec = pose_windows(pose)
    batch = every_window(windows)
    forecast = Persistence(scaler, spec).forecast(batch.context, batch.known_future)
    physical = scaler.unscale_targets(forecast.numpy())
    still = pose.write(np.zeros(3))
    np.testing.assert_allclose(
        physical[..., :-1], np.broadcast_to(still, physical[..., :-1].shape), atol=1e-5
    )
    recorded = np.tile(np.sin(np.arange(120) / RATE_HZ), 3)[windows.issues.numpy()]
    np.testing.assert_allclose(physical[:, -1, -1], recorded, atol=1e-5)


@pytest.mark.parametrize("pose", [ANGLE, QUATERNION])
def test_a_body_that_keeps_its_turn_is_forecast_exactly(pose):
    windows, scaler, spec = pose_windows(pose)
    forecaster = constant_velocity(scaler, spec)
    forecaster.fit(windows, windows)
    batch = every_window(windows)
    forecast = forecaster.forecast(batch.context, batch.known_future)
    torch.testing.assert_close(forecast[..., :-1], batch.truth[..., :-1], atol=2e-4, rtol=0)


def test_a_body_that_goes_straight_is_forecast_exactly():
    time_s = np.arange(40) / RATE_HZ
    values = np.column_stack([0.5 * time_s, 0.2 * time_s, np.zeros(40)])
    pose = replace(ANGLE, in_degrees=False)
    recording = Recording("straight", RecordingInfo("body"), time_s, values)
    spec = WindowSpec(8, 12, (0, 1), (), (), pose)
    scaler = Scaler.fit([recording], spec)
    windows = WindowSet([recording], scaler, spec)
    forecaster = constant_velocity(scaler, spec)
    forecaster.fit(windows, windows)
    batch = every_window(windows)
    forecast = forecaster.forecast(batch.context, batch.known_future)
    torch.testing.assert_close(forecast, batch.truth, atol=1e-4, rtol=0)


def test_a_ramp_goes_on_and_noise_is_held():
    noise = np.random.default_rng(1).normal(size=400).cumsum()
    values = np.column_stack([np.zeros(400), np.arange(400.0), noise])
    windows, scaler, spec = state_windows(values)
    forecaster = constant_velocity(scaler, spec)
    forecaster.fit(windows, windows)
    assert [damping for _, damping in forecaster.chosen] == [1.0, 0.0]
    batch = every_window(windows)
    forecast = forecaster.forecast(batch.context, batch.known_future)
    torch.testing.assert_close(forecast[..., 0], batch.truth[..., 0], atol=1e-4, rtol=0)
    held = Persistence(scaler, spec).forecast(batch.context, batch.known_future)
    torch.testing.assert_close(forecast[..., 1], held[..., 1])


def test_a_slope_over_more_steps_is_taken_where_samples_are_noisy():
    ramp = np.arange(400.0) + np.random.default_rng(2).normal(scale=3.0, size=400)
    windows, scaler, spec = state_windows(np.column_stack([ramp, ramp, ramp]), outputs=(0,))
    forecaster = constant_velocity(scaler, spec, steps=(1, 8), dampings=(1.0,))
    forecaster.fit(windows, windows)
    assert forecaster.chosen == [(8, 1.0)]


def test_a_slope_longer_than_the_context_is_refused():
    _, scaler, spec = state_windows(np.random.default_rng(3).normal(size=(40, 3)))
    with pytest.raises(OdisarError, match="slope_steps=\\[10\\] do not fit"):
        constant_velocity(scaler, spec, steps=(10,))


def test_constant_velocity_says_that_it_is_not_fitted():
    windows, scaler, spec = state_windows(np.random.default_rng(3).normal(size=(40, 3)))
    batch = every_window(windows)
    with pytest.raises(OdisarError, match="call fit first"):
        constant_velocity(scaler, spec).forecast(batch.context, batch.known_future)
