"""Does the simulated base do what such a base does in an office? Over the undisturbed test tasks.

Ranges come from the base's own limits (PAL Robotics' mobile_base_controller), its footprint, and
from what the case declares of a recording; the lower end of a task's length is published.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.config.robot import RobotSimulatorConfig
from odisar.recordings.schema import UNDISTURBED
from odisar.simulators.robot.fleet import TaskPlan, plan_fleet
from odisar.simulators.robot.grid import Array
from odisar.simulators.robot.journey import (
    Journey,
    JourneyMaker,
    footprint_touches,
    run_stream,
)
from odisar.simulators.robot.odometry import draw_stamps, log_odometry, true_pose
from odisar.simulators.robot.office import build_office

_STANDING_M_S, _STANDING_RAD_S = 0.01, 0.01
_TASKS_DRAWN = 4

_Row = tuple[str, float, str, float, float]


@dataclass(frozen=True)
class MapTraces:
    """What a figure of the office shows.

    ``occupied`` (row, column) from the lower left corner; ``paths`` are (step, 2) [m] and
    ``waypoints`` (waypoint, 2) [m], of a few tasks; a task's first point is its start.
    """

    occupied: NDArray[np.bool_]
    resolution_m: float
    paths: list[Array]
    waypoints: list[Array]


@dataclass(frozen=True)
class _Trip:
    """An undisturbed task and its odometry (sample, 6) at ``stamps_s``."""

    journey: Journey
    stamps_s: Array
    odometry: Array

    @property
    def steps_s(self) -> Array:
        """Time from each sample to the next."""
        return np.asarray(np.diff(self.stamps_s))


def plausibility_table(config: RobotSimulatorConfig, base_seed: int) -> pd.DataFrame:
    """Return what the base does beside what such a base does.

    Columns ``quantity``, ``value``, ``unit``, ``low``, ``high``, ``plausible``.
    """
    trips = list(_trips(config, base_seed))
    rows = [
        *_task_rows(trips, config),
        *_motion_rows(trips, config),
        *_stamp_rows(trips),
        *_odometry_rows(trips),
    ]
    table = pd.DataFrame(rows, columns=["quantity", "value", "unit", "low", "high"])
    table["plausible"] = table["value"].between(table["low"], table["high"])
    return table


def map_traces(config: RobotSimulatorConfig, base_seed: int) -> MapTraces:
    """Return the office, and the paths and waypoints of a few undisturbed tasks."""
    grid = build_office(config.office, base_seed)
    maker = JourneyMaker(grid, config, base_seed)
    journeys = [maker.make(plan, None) for plan in _clean_plans(config)[:_TASKS_DRAWN]]
    return MapTraces(
        occupied=grid.occupied,
        resolution_m=grid.resolution_m,
        paths=[journey.motion.pose[:, :2] for journey in journeys],
        waypoints=[journey.task.points for journey in journeys],
    )


def _clean_plans(config: RobotSimulatorConfig) -> list[TaskPlan]:
    plans = [plan for plan in plan_fleet(config.fleet) if plan.disturbance == UNDISTURBED]
    return [plan for plan in plans if plan.split == "test"] or plans


def _trips(config: RobotSimulatorConfig, base_seed: int) -> Iterator[_Trip]:
    maker = JourneyMaker(build_office(config.office, base_seed), config, base_seed)
    for plan in _clean_plans(config):
        journey = maker.make(plan, None)
        duration_s = journey.motion.duration_s
        stamps_s = draw_stamps(run_stream(base_seed, plan, "stamps"), duration_s, config.odometry)
        stream = run_stream(base_seed, plan, "odometry")
        yield _Trip(journey, stamps_s, log_odometry(stream, journey.motion, stamps_s, config))


def _task_rows(trips: list[_Trip], config: RobotSimulatorConfig) -> Iterator[_Row]:
    durations = np.array([trip.journey.motion.duration_s for trip in trips])
    firsts = np.array([trip.journey.motion.arrivals_s[0] for trip in trips])
    ways = np.array([np.hypot(*_steps(trip.journey.motion.pose)).sum() for trip in trips])
    standing = np.concatenate([_is_standing(trip) for trip in trips])
    low, high = config.task.duration_s.low, config.task.duration_s.high
    yield "task, shortest", durations.min(), "s", low, high
    yield "task, median", float(np.median(durations)), "s", 200.0, 450.0
    yield "task, longest", durations.max(), "s", low, high
    yield "first waypoint, earliest", firsts.min(), "s", 10.0, 180.0
    yield "first waypoint, latest", firsts.max(), "s", 10.0, 180.0
    yield "way of a task, median", float(np.median(ways)), "m", 60.0, 250.0
    yield "share of the time standing", float(standing.mean()), "1", 0.03, 0.2


def _motion_rows(trips: list[_Trip], config: RobotSimulatorConfig) -> Iterator[_Row]:
    motions = [trip.journey.motion for trip in trips]
    step_s = config.drive.step_s
    speed = max(float(np.hypot(*motion.twist[:, :2].T).max()) for motion in motions)
    turning = max(float(np.abs(motion.twist[:, 2]).max()) for motion in motions)
    gain = max(float(np.hypot(*_steps(motion.twist)).max()) for motion in motions) / step_s
    turn_gain = max(float(np.abs(np.diff(motion.twist[:, 2])).max()) for motion in motions) / step_s
    clearance = min(
        float(trip.journey.grid.clearance_at(*trip.journey.motion.pose[:, :2].T).min())
        for trip in trips
    )
    touching = sum(footprint_touches(trip.journey, config) for trip in trips)
    # The base's own limits: 0.7 m/s over x and y, 1 m/s2 and 120 deg/s2 on every axis.
    yield "largest speed", speed, "m/s", 0.3, 0.7
    yield "largest yaw rate", turning, "rad/s", 0.3, 2.1
    yield "largest acceleration", gain, "m/s2", 0.1, 1.0
    yield "largest yaw acceleration", turn_gain, "rad/s2", 0.1, 2.1
    yield "smallest clearance of the centre", clearance, "m", 0.5 * config.base.width_m, 1.0
    yield "tasks that touch something", float(touching), "1", 0.0, 0.0


def _stamp_rows(trips: list[_Trip]) -> Iterator[_Row]:
    steps_s = np.concatenate([trip.steps_s for trip in trips])
    yield "rate, from the median step", float(1.0 / np.median(steps_s)), "Hz", 9.9, 10.1
    yield "stamps' steps, standard deviation", 1e3 * float(steps_s.std()), "ms", 1.0, 10.0
    yield "stamps' steps, shortest", 1e3 * float(steps_s.min()), "ms", 50.0, 100.0
    yield "stamps' steps, longest", 1e3 * float(steps_s.max()), "ms", 100.0, 150.0


def _odometry_rows(trips: list[_Trip]) -> Iterator[_Row]:
    differences = np.concatenate([_difference_m(trip) for trip in trips])
    norms = np.concatenate([_quaternion_norms(trip) for trip in trips])
    drifts = [float(np.hypot(*(trip.odometry - _padded(trip))[-1, :2])) for trip in trips]
    yield "quaternion's norm, largest error", float(np.abs(norms - 1.0).max()), "1", 0.0, 2e-6
    yield "pose step against velocity, rms", 1e3 * _rms(differences), "mm", 0.01, 2.0
    yield "pose step against velocity, largest", 1e3 * float(differences.max()), "mm", 0.1, 10.0
    yield "odometry's error at the end, median", float(np.median(drifts)), "m", 0.01, 2.0
    yield "odometry's error at the end, largest", max(drifts), "m", 0.01, 5.0


def _padded(trip: _Trip) -> Array:
    """Return the true pose at the stamps, with zeros in the place of the twist."""
    pose = true_pose(trip.journey.motion, trip.stamps_s)
    return np.concatenate([pose, np.zeros_like(pose)], axis=1)


def _difference_m(trip: _Trip) -> Array:
    """Return (sample - 1,): how far each step of the pose is from the velocities around it."""
    x, y, yaw, vx, vy, _ = trip.odometry.T
    middle = 0.5 * (yaw[1:] + yaw[:-1])
    dx, dy = np.diff(x), np.diff(y)
    ahead = dx * np.cos(middle) + dy * np.sin(middle) - vx[1:] * trip.steps_s
    aside = dy * np.cos(middle) - dx * np.sin(middle) - vy[1:] * trip.steps_s
    return np.asarray(np.hypot(ahead, aside))


def _quaternion_norms(trip: _Trip) -> Array:
    """Return (sample,): the norm of the orientation as it's written, with six decimals."""
    half = 0.5 * trip.odometry[:, 2]
    return np.asarray(np.hypot(np.round(np.sin(half), 6), np.round(np.cos(half), 6)))


def _is_standing(trip: _Trip) -> NDArray[np.bool_]:
    speed = np.hypot(trip.odometry[:, 3], trip.odometry[:, 4])
    return np.asarray((speed < _STANDING_M_S) & (np.abs(trip.odometry[:, 5]) < _STANDING_RAD_S))


def _steps(rows: Array) -> Array:
    """Return (2, row - 1): the steps of the first two columns."""
    return np.asarray(np.diff(rows[:, :2], axis=0).T)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
