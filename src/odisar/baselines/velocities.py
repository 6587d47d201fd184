"""Which channels are the velocities of a pose, and how far the pose's rates are from them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.baselines.interface import Reference
from odisar.config.cases import Case
from odisar.errors import OdisarError
from odisar.recordings.schema import Recording
from odisar.windows.coordinates import POSE_RATES, PoseChannels, pose_rates

FloatArray = NDArray[np.float64]

# A velocity follows the pose's rate so closely at least, and one to one within a fifth.
_LEAST_CORRELATION = 0.9
_LEAST_SLOPE, _LARGEST_SLOPE = 0.8, 1.25


class NoVelocityError(OdisarError):
    """No channel of the case is a velocity of a relative pose: there is nothing to compare."""


@dataclass(frozen=True)
class Velocity:
    """A channel as a velocity of the pose.

    ``factor`` brings it to m/s or rad/s. ``is_mean`` is True where the mean of the velocities at
    both ends of an interval stands for it, else that at its end does.
    """

    channel: int
    factor: float
    is_mean: bool

    def over_intervals(self, values: FloatArray) -> FloatArray:
        """Return (sample - 1,) velocities between the samples of (sample, channel) values."""
        logged = values[:, self.channel] * self.factor
        return (logged[1:] + logged[:-1]) / 2 if self.is_mean else logged[1:]


@dataclass(frozen=True)
class PoseComparison:
    """A pose, and by rate (0 along, 1 across, 2 about) the velocity that it is held against."""

    pose: PoseChannels
    velocities: dict[int, Velocity]

    def residuals(self, time_s: FloatArray, values: FloatArray) -> FloatArray:
        """Return (sample, compared rate) rates less velocities [m/s, rad/s] of one segment.

        The first sample has no rate: NaN.
        """
        residuals = np.full((len(time_s), len(self.velocities)), np.nan)
        rates = pose_rates(time_s, self.pose.read(values))
        for place, (rate, velocity) in enumerate(self.velocities.items()):
            residuals[1:, place] = rates[1:, rate] - velocity.over_intervals(values)
        return residuals


def compare_pose(reference: Reference) -> PoseComparison:
    """Return what the rates of a reference's pose are held against.

    The velocity of a rate is the state outside the pose that correlates best with it over the
    training recordings, taken at an interval's end or as the mean of both ends, if the correlation
    is at least 0.9 and the least squares slope of the rate on it between 0.8 and 1.25. A rate
    without such a state is not compared. Raises NoVelocityError if none is.
    """
    pose = reference.spec.pose
    if pose is None:
        raise NoVelocityError(
            "the case declares no relative pose; leave out the check of its rates"
        )
    segments = segment_samples(reference.train)
    rates = [pose_rates(time_s, pose.read(values))[1:] for time_s, values in segments]
    candidates = [
        (velocity, np.concatenate([velocity.over_intervals(values) for _, values in segments]))
        for velocity in _candidates(reference.case, pose)
    ]
    found = {rate: _best(np.concatenate(rates)[:, rate], candidates) for rate in range(POSE_RATES)}
    velocities = {rate: velocity for rate, velocity in found.items() if velocity is not None}
    if not velocities:
        raise NoVelocityError(
            "no state follows a rate of the pose one to one (correlation above "
            f"{_LEAST_CORRELATION}, slope {_LEAST_SLOPE} to {_LARGEST_SLOPE}); leave out the check "
            "of its rates, or log velocities in the body's axes"
        )
    return PoseComparison(pose, velocities)


def has_velocity_candidates(case: Case) -> bool:
    """Whether a case has a relative pose and states besides, which may be its velocities."""
    if case.pose is None or case.pose.coordinates == "absolute":
        return False
    pose = case.pose.channels
    return any(channel.role == "state" and channel.name not in pose for channel in case.channels)


def segment_samples(recordings: Sequence[Recording]) -> list[tuple[FloatArray, FloatArray]]:
    """Return times (sample,) and values (sample, channel) of the stretches without a gap."""
    return [
        (recording.time_s[start:stop], recording.values[start:stop])
        for recording in recordings
        for start, stop in recording.segments
    ]


def _candidates(case: Case, pose: PoseChannels) -> list[Velocity]:
    return [
        Velocity(place, _to_si(channel.unit), is_mean)
        for place, channel in enumerate(case.channels)
        if channel.role == "state" and place not in pose.positions
        for is_mean in (False, True)
    ]


def _to_si(unit: str) -> float:
    """Return the factor from a velocity's unit to m/s or rad/s."""
    return float(np.deg2rad(1.0)) if unit.casefold().startswith(("deg", "°")) else 1.0


def _best(rate: FloatArray, candidates: Sequence[tuple[Velocity, FloatArray]]) -> Velocity | None:
    """Return the velocity that correlates best with a (interval,) rate, if it is one at all."""
    best, best_correlation = None, _LEAST_CORRELATION
    for velocity, logged in candidates:
        spread, rate_spread = logged.std(), rate.std()
        if min(spread, rate_spread) == 0:
            continue
        together = np.mean((logged - logged.mean()) * (rate - rate.mean()))
        correlation, slope = together / (spread * rate_spread), together / spread**2
        if correlation >= best_correlation and _LEAST_SLOPE <= slope <= _LARGEST_SLOPE:
            best, best_correlation = velocity, correlation
    return best
