"""Odometry as a mecanum base makes it: wheel counts, integrated, stamped by a busy computer.

The pose adds up wheel counts read at every period of the base's controller; the velocity is the
counts over a short window that ends at the stamp, as the rolling mean of ROS' drive controllers.
Both come from the same counts, so they agree but for quantisation and the moment of reading.
"""

import numpy as np

from odisar.config.robot import BaseConfig, OdometryConfig, RobotSimulatorConfig
from odisar.simulators.robot.grid import Array
from odisar.simulators.robot.motion import Motion

#: Columns of the odometry before the yaw becomes a quaternion.
POSE_AND_TWIST = ("x", "y", "yaw", "vx", "vy", "wz")

_DECIMALS = 6


def draw_stamps(stream: np.random.Generator, duration_s: float, config: OdometryConfig) -> Array:
    """Return stamps (sample,) [s] from zero on, jittered, now and then late, six decimals."""
    count = int(duration_s * config.rate_hz)
    limit_s = config.stamp_jitter_limit_s
    jitter_s = np.clip(config.stamp_jitter_s * stream.standard_normal(count), -limit_s, limit_s)
    late_s = config.late_s.low + (config.late_s.high - config.late_s.low) * stream.random(count)
    jitter_s += np.where(stream.random(count) < config.late_share, late_s, 0.0)
    jitter_s[0] = 0.0
    return np.round(np.arange(count) / config.rate_hz + jitter_s, _DECIMALS)


def log_odometry(
    stream: np.random.Generator, motion: Motion, stamps_s: Array, config: RobotSimulatorConfig
) -> Array:
    """Return (sample, 6): x, y [m], unwrapped yaw [rad] and the twist in the base's axes.

    Odometry starts at the true pose, as where its frame is laid on the map at the start.
    """
    odometry = config.odometry
    shares = np.arange(1, odometry.reads_per_sample + 1) / odometry.reads_per_sample
    reads_s = (stamps_s[:-1, None] + np.diff(stamps_s)[:, None] * shares).ravel()
    reads_s = np.concatenate([stamps_s[:1], reads_s])
    before_s = stamps_s - odometry.velocity_window_s
    phases = stream.random(4)
    way = _Counted(motion, config.base, phases)
    read = way.at(_jittered(stream, reads_s, odometry))
    at_stamps = read[:: odometry.reads_per_sample]
    before = way.at(_jittered(stream, before_s, odometry))
    twist = (at_stamps - before) / odometry.velocity_window_s
    pose = _integrated(np.diff(read, axis=0), motion.pose[0])[:: odometry.reads_per_sample]
    return np.concatenate([pose, twist], axis=1)


def true_pose(motion: Motion, times_s: Array) -> Array:
    """Return where the base was (time, 3) at any times."""
    return np.stack(
        [np.interp(times_s, motion.time_s, motion.pose[:, i]) for i in range(3)], axis=1
    )


class _Counted:
    """The way that the wheels have counted, in the base's axes."""

    def __init__(self, motion: Motion, base: BaseConfig, phases: Array) -> None:
        self._time_s, self._twist = motion.time_s, motion.twist
        mean = 0.5 * (motion.twist[1:] + motion.twist[:-1])
        steps = mean * np.diff(motion.time_s)[:, None]
        self._way = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
        # Mecanum wheels front left, front right, rear left, rear right: rim speed over twist.
        reach = base.wheel_reach_m
        self._rims = np.array([[1, -1, -reach], [1, 1, reach], [1, 1, -reach], [1, -1, reach]])
        self._back = np.linalg.pinv(self._rims)
        self._count_m = 2.0 * np.pi * base.wheel_radius_m / base.encoder_counts
        self._phases = phases

    def at(self, times_s: Array) -> Array:
        """Return the counted way (time, 3): ahead, aside [m], turned [rad]."""
        rims_m = self._travelled(times_s) @ self._rims.T
        counts = np.floor(rims_m / self._count_m + self._phases)
        return np.asarray(counts * self._count_m @ self._back.T)

    def _travelled(self, times_s: Array) -> Array:
        """Return the integral of the twist, which runs straight from step to step."""
        times_s = np.clip(times_s, self._time_s[0], self._time_s[-1])
        step = np.clip(np.searchsorted(self._time_s, times_s, side="right") - 1, 0, None)
        step = np.minimum(step, len(self._time_s) - 2)
        since = (times_s - self._time_s[step])[:, None]
        length = (self._time_s[step + 1] - self._time_s[step])[:, None]
        gain = (self._twist[step + 1] - self._twist[step]) / length
        return np.asarray(self._way[step] + since * (self._twist[step] + 0.5 * since * gain))


def _jittered(stream: np.random.Generator, times_s: Array, config: OdometryConfig) -> Array:
    return np.asarray(times_s + config.read_jitter_s * stream.standard_normal(len(times_s)))


def _integrated(ways: Array, start: Array) -> Array:
    """Return poses (1 + way, 3) along ways (way, 3) in the base's axes, turned by half each."""
    yaw = start[2] + np.concatenate([[0.0], np.cumsum(ways[:, 2])])
    middle = 0.5 * (yaw[1:] + yaw[:-1])
    cos, sin = np.cos(middle), np.sin(middle)
    x = start[0] + np.concatenate([[0.0], np.cumsum(ways[:, 0] * cos - ways[:, 1] * sin)])
    y = start[1] + np.concatenate([[0.0], np.cumsum(ways[:, 0] * sin + ways[:, 1] * cos)])
    return np.stack([x, y, yaw], axis=1)
