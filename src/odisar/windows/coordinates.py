"""What the twin sees of a sample and what it forecasts: the channels, or a pose made relative.

A robot's absolute position says where in the building it is, not how it moves. In relative
coordinates the pose enters as its rate of change and leaves as the displacement from the last
observed pose, in that pose's frame. Only what a case declares as ``pose`` is transformed; without
one, features are the channels themselves.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.config.cases import Case
from odisar.recordings.schema import Recording

FloatArray = NDArray[np.float64]

#: Features that stand for a relative pose: rates along, across and about the body's axes.
POSE_RATES = 3


@dataclass(frozen=True)
class PoseChannels:
    """Where a planar pose stands among the channels.

    ``heading`` is one position (an angle) or two (z and w of a quaternion about the vertical).
    """

    x: int
    y: int
    heading: tuple[int, ...]
    in_degrees: bool

    @property
    def positions(self) -> tuple[int, ...]:
        """Positions of all channels of the pose."""
        return (self.x, self.y, *self.heading)

    def read(self, values: FloatArray) -> FloatArray:
        """Return (..., 3) x, y [m] and heading [rad] from (..., channel) values."""
        if len(self.heading) == 1:
            heading = values[..., self.heading[0]]
            heading = np.deg2rad(heading) if self.in_degrees else heading
        else:
            z, w = (values[..., i] for i in self.heading)
            heading = 2.0 * np.arctan2(z, w)
        return np.stack([values[..., self.x], values[..., self.y], heading], axis=-1)

    def write(self, pose: FloatArray) -> FloatArray:
        """Return (..., pose channel), in the order of ``positions``, from (..., 3) poses."""
        angle = pose[..., 2]
        if len(self.heading) == 1:
            heading = [np.rad2deg(angle) if self.in_degrees else angle]
        else:
            heading = [np.sin(angle / 2.0), np.cos(angle / 2.0)]
        return np.stack([pose[..., 0], pose[..., 1], *heading], axis=-1)


def pose_channels(case: Case) -> PoseChannels | None:
    """Return the pose that a case declares as relative, or None."""
    if case.pose is None or case.pose.coordinates == "absolute":
        return None
    names = case.channel_names
    heading = tuple(names.index(name) for name in case.pose.heading)
    return PoseChannels(
        x=names.index(case.pose.x),
        y=names.index(case.pose.y),
        heading=heading,
        in_degrees=not case.channels[heading[0]].unit.casefold().startswith("rad"),
    )


def wrap_angle(angle: FloatArray) -> FloatArray:
    """Return the angle [rad] between -pi and pi."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def relative_to(pose: FloatArray, origin: FloatArray) -> FloatArray:
    """Return (..., 3) poses in the frame of ``origin`` (..., 3)."""
    along, across = _rotate(pose[..., :2] - origin[..., :2], -origin[..., 2])
    return np.stack([along, across, wrap_angle(pose[..., 2] - origin[..., 2])], axis=-1)


def moved_from(origin: FloatArray, displacement: FloatArray) -> FloatArray:
    """Return (..., 3) poses that lie at ``displacement`` (..., 3) in the frame of ``origin``."""
    dx, dy = _rotate(displacement[..., :2], origin[..., 2])
    heading = wrap_angle(origin[..., 2] + displacement[..., 2])
    return np.stack([origin[..., 0] + dx, origin[..., 1] + dy, heading], axis=-1)


def pose_rates(time_s: FloatArray, pose: FloatArray) -> FloatArray:
    """Return (sample, 3) rates of the pose along, across [m/s] and about [rad/s] the body's axes.

    Increments divided by the difference of their stamps: stamps jitter, and an increment over 90 ms
    is no slower than one over 110 ms. The frame is that of the mean heading of both poses. The
    first sample has no increment: NaN.
    """
    rates = np.full_like(pose, np.nan)
    steps_s = np.diff(time_s)
    turned = wrap_angle(np.diff(pose[:, 2]))
    middle = pose[:-1, 2] + turned / 2.0
    along, across = _rotate(np.diff(pose[:, :2], axis=0), -middle)
    rates[1:] = np.column_stack([along, across, turned]) / steps_s[:, None]
    return rates


def features(recording: Recording, pose: PoseChannels | None) -> FloatArray:
    """Return (sample, feature) what the twin sees, in physical units.

    Without a relative pose the channels, else the pose's rates and then the other channels in
    their order. The first sample of a segment has no rate (NaN) and is in no window.
    """
    if pose is None:
        return recording.values
    rates = np.concatenate(
        [
            pose_rates(recording.time_s[start:stop], pose.read(recording.values[start:stop]))
            for start, stop in recording.segments
        ]
    )
    others = other_channels(recording.values.shape[1], pose)
    return np.column_stack([rates, recording.values[:, others]])


def other_channels(channels: int, pose: PoseChannels) -> list[int]:
    """Return the positions of the channels that are no part of the pose."""
    return [i for i in range(channels) if i not in pose.positions]


def feature_positions(
    wanted: Sequence[int], channels: int, pose: PoseChannels | None
) -> tuple[int, ...]:
    """Return where channels (none of the pose) stand among the features."""
    if pose is None:
        return tuple(wanted)
    others = other_channels(channels, pose)
    return tuple(POSE_RATES + others.index(i) for i in wanted)


def _rotate(vectors: FloatArray, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return cos * x - sin * y, sin * x + cos * y
