"""Make the recordings: plan the fleet, drive each task, log its odometry."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from odisar.config.robot import RobotSimulatorConfig
from odisar.errors import OdisarError
from odisar.recordings.schema import (
    UNDISTURBED,
    Interval,
    Recording,
    RecordingInfo,
    label_times,
)
from odisar.simulators.robot.faults import disturb_odometry
from odisar.simulators.robot.fleet import ALL_COMPONENTS, TaskPlan, plan_fleet
from odisar.simulators.robot.grid import Array
from odisar.simulators.robot.journey import Journey, JourneyMaker, run_stream
from odisar.simulators.robot.odometry import draw_stamps, log_odometry
from odisar.simulators.robot.office import build_office
from odisar.simulators.robot.ranges import SECTORS, sense_ranges

#: Channels of nav_msgs/Odometry that a base on a floor fills.
CHANNELS = (
    "position_x",
    "position_y",
    "orientation_z",
    "orientation_w",
    "linear_velocity_x",
    "linear_velocity_y",
    "angular_velocity_z",
)

#: Sectors of what the lidars see, anticlockwise from straight ahead; made only where asked for.
RANGE_CHANNELS = tuple(f"Range {sector:02d}" for sector in range(SECTORS))

_IN_ODOMETRY = ("noise", "correlated-noise", "bias", "drift")
_DECIMALS = 6


def simulate_robot(
    config: RobotSimulatorConfig, base_seed: int, channel_names: Sequence[str]
) -> Iterator[Recording]:
    """Return every recording of the configured fleet, with these channels, in a fixed order.

    The same configuration and seed give the same values; leaving tasks or channels out changes
    nothing else. Raises OdisarError for a channel that a robot doesn't have.
    """
    unknown = [name for name in channel_names if name not in CHANNELS + RANGE_CHANNELS]
    if unknown:
        raise OdisarError(
            f"the robot simulator has no channel {unknown[0]!r}; it can make "
            f"{', '.join(CHANNELS)} and {RANGE_CHANNELS[0]} to {RANGE_CHANNELS[-1]}"
        )
    return simulate_tasks(plan_fleet(config.fleet), config, base_seed, channel_names)


def simulate_tasks(
    plans: Sequence[TaskPlan],
    config: RobotSimulatorConfig,
    base_seed: int,
    channel_names: Sequence[str],
) -> Iterator[Recording]:
    """Yield the recordings of these tasks."""
    maker = JourneyMaker(build_office(config.office, base_seed), config, base_seed)
    for plan in plans:
        logged = None
        for name, strength in plan.recordings:
            # Only slip moves the base differently at another strength.
            if logged is None or plan.disturbance == "slip":
                journey = maker.make(plan, strength)
                logged = _log(plan, journey, config, base_seed, channel_names)
            yield _recording(name, strength, logged, channel_names)


@dataclass(frozen=True)
class _Logged:
    """A journey and what its sensors logged before anything disturbed them.

    ``odometry`` is (sample, 6), ``ranges`` (sample, sector) or None where they aren't asked for.
    """

    plan: TaskPlan
    journey: Journey
    stamps_s: Array
    odometry: Array
    ranges: Array | None
    config: RobotSimulatorConfig
    base_seed: int


def _log(
    plan: TaskPlan,
    journey: Journey,
    config: RobotSimulatorConfig,
    base_seed: int,
    channel_names: Sequence[str],
) -> _Logged:
    stamps_s = draw_stamps(
        run_stream(base_seed, plan, "stamps"), journey.motion.duration_s, config.odometry
    )
    odometry = log_odometry(
        run_stream(base_seed, plan, "odometry"), journey.motion, stamps_s, config
    )
    ranges = None
    if set(channel_names) & set(RANGE_CHANNELS):
        ranges = sense_ranges(run_stream(base_seed, plan, "ranges"), journey, stamps_s, config)
    return _Logged(plan, journey, stamps_s, odometry, ranges, config, base_seed)


def _recording(
    name: str, strength: float | None, logged: _Logged, channel_names: Sequence[str]
) -> Recording:
    plan, stamps_s = logged.plan, logged.stamps_s
    intervals = tuple(_intervals(logged))
    odometry, detail = logged.odometry, logged.journey.detail
    if plan.disturbance in _IN_ODOMETRY and strength is not None:
        odometry, detail = disturb_odometry(
            run_stream(logged.base_seed, plan, "fault"),
            plan.disturbance,
            strength,
            odometry,
            stamps_s,
            label_times(stamps_s, intervals),
            logged.config.disturbances,
        )
    columns = dict(zip(CHANNELS, _channels(odometry), strict=True))
    if logged.ranges is not None:
        columns |= dict(zip(RANGE_CHANNELS, logged.ranges.T, strict=True))
    values = np.stack([columns[channel] for channel in channel_names], axis=1)
    return Recording(
        name=name,
        info=_info(plan, strength, logged.journey, detail),
        time_s=stamps_s,
        # Adding zero turns a negative zero into a positive one: "-0.000000" would be a second zero.
        values=np.round(values, _DECIMALS) + 0.0,
        intervals=intervals,
    )


def _channels(odometry: Array) -> list[Array]:
    """Return the seven channels; the yaw, unwrapped, becomes a quaternion that never jumps."""
    x, y, yaw, *twist = odometry.T
    return [x, y, np.sin(0.5 * yaw), np.cos(0.5 * yaw), *twist]


def _intervals(logged: _Logged) -> Iterator[Interval]:
    """Yield the disturbed stretches, from sample to sample."""
    stamps_s = logged.stamps_s
    for span_s in logged.journey.spans_s:
        first, after = np.searchsorted(stamps_s, np.round(span_s, _DECIMALS))
        if first < min(after, len(stamps_s) - 1):
            end_s = float(stamps_s[min(after, len(stamps_s) - 1)])
            yield Interval(float(stamps_s[first]), end_s, logged.plan.disturbance)


def _info(plan: TaskPlan, strength: float | None, journey: Journey, detail: str) -> RecordingInfo:
    return RecordingInfo(
        case="robot",
        maneuver="waypoint",
        disturbance=plan.disturbance,
        components=UNDISTURBED if plan.disturbance == UNDISTURBED else ALL_COMPONENTS,
        strength=strength,
        base_seed=plan.seed_name,
        split=plan.split,
        extra={
            "cruise_m_s": f"{journey.task.cruise_m_s:.3f}",
            "first_waypoint_s": f"{journey.motion.arrivals_s[0]:.2f}",
            "detail": detail,
        },
    )
