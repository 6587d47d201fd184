"""A task and its legs: which waypoints, on which paths, how fast and facing where."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import minimum_filter1d

from odisar.config.robot import DriveConfig, RobotSimulatorConfig, TaskConfig
from odisar.simulators.robot.grid import Array, Grid
from odisar.simulators.robot.office import draw
from odisar.simulators.robot.planning import Planner

_POINT_TRIES = 200
#: A base faces as at the goal only where the clearance is this [m] for a metre around ...
_TURNING_ROOM_M, _ROOM_AROUND_M = 0.65, 1.0
#: ... and there for the last stretch [m] of every leg; elsewhere it turns once it's there.
_LAST_STRETCH_M = 0.8


@dataclass(frozen=True)
class Task:
    """A start and waypoints, ``points`` (1 + waypoint, 2) [m], and the draws of their legs.

    ``stands_s`` (1 + waypoint,) is how long the base stands at each point; ``facing`` (1 +
    waypoint,) the heading [rad] it has there; ``faces_goal`` (waypoint,) whether it drives the leg
    facing as at its end.
    """

    points: Array
    facing: Array
    stands_s: Array
    faces_goal: tuple[bool, ...]
    cruise_m_s: float


@dataclass(frozen=True)
class Leg:
    """One drive to a stop: ``path`` (point, 2) [m], ``speed`` and ``heading`` (point,).

    ``facing`` is the heading at the end (None: as it comes), ``stand_s`` the time stood there;
    ``waypoint`` says whether the end is a waypoint.
    """

    path: Array
    speed: Array
    heading: Array
    facing: float | None
    stand_s: float
    waypoint: bool

    @property
    def along_m(self) -> Array:
        """Way from the leg's start to each point."""
        return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.path, axis=0).T))])


def draw_task(stream: np.random.Generator, planner: Planner, config: RobotSimulatorConfig) -> Task:
    """Draw a task; every task takes the same draws but for its points."""
    task, drive = config.task, config.drive
    count = task.waypoints
    return Task(
        facing=2.0 * np.pi * stream.random(count + 1) - np.pi,
        stands_s=np.array(
            [draw(stream, task.start_s), *(draw(stream, task.stand_s) for _ in range(count))]
        ),
        faces_goal=tuple(bool(x < drive.goal_heading_share) for x in stream.random(count)),
        cruise_m_s=draw(stream, drive.cruise_m_s),
        points=_draw_points(stream, planner, task),
    )


def _draw_points(stream: np.random.Generator, planner: Planner, task: TaskConfig) -> Array:
    """Return start and waypoints, apart from one another; as many as could be found."""
    roomy = planner.nodes[planner.clearance_m >= task.clearance_m]
    points = [roomy[stream.integers(len(roomy))]]
    for _ in range(_POINT_TRIES):
        point = roomy[stream.integers(len(roomy))]
        if np.hypot(*(np.array(points) - point).T).min() >= task.separation_m:
            points.append(point)
            if len(points) == task.waypoints + 1:
                break
    return np.array(points)


def plan_legs(task: Task, grid: Grid, planner: Planner, config: RobotSimulatorConfig) -> list[Leg]:
    """Return the legs of a task in the office as it was mapped."""
    starts = enumerate(task.points[:-1])
    return [plan_leg(task, i, start, grid, planner, config) for i, start in starts]


def plan_leg(
    task: Task,
    number: int,
    start: Array,
    grid: Grid,
    planner: Planner,
    config: RobotSimulatorConfig,
) -> Leg:
    """Return leg ``number`` of a task, from a point that may lie on the way."""
    path = planner.path(start, task.points[number + 1])
    facing = float(task.facing[number + 1])
    heading = _headings(path, grid, facing, faces_goal=task.faces_goal[number])
    speed = speed_profile(path, grid, task.cruise_m_s, config.drive)
    return Leg(path, speed, heading, facing, float(task.stands_s[number + 1]), waypoint=True)


def speed_profile(path: Array, grid: Grid, cruise_m_s: float, drive: DriveConfig) -> Array:
    """Return the speed [m/s] at each point: slower in bends and doorways, zero at the end."""
    steps = np.diff(path, axis=0)
    lengths = np.hypot(*steps.T)
    directions = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    bend = np.zeros(len(path))
    bend[1:-1] = np.abs(np.diff(directions)) / lengths[1:]
    bend = np.convolve(np.pad(bend, 2, mode="edge"), np.full(5, 0.2), mode="valid")
    in_bends = np.sqrt(drive.lateral_acceleration_m_s2 / np.maximum(bend, 1e-6))
    # From the clearance of a narrow doorway to that of a corridor.
    room = np.clip((grid.clearance_at(*path.T) - 0.45) / 0.4, 0.0, 1.0)
    narrow = cruise_m_s * (drive.narrow_share + (1.0 - drive.narrow_share) * room)
    speed = np.minimum(np.minimum(in_bends, narrow), cruise_m_s)
    return braked(speed, lengths, drive)


def braked(speed: Array, lengths: Array, drive: DriveConfig) -> Array:
    """Return speeds from which the base can brake for every point ahead, and at the end stop."""
    braking = drive.braking_share * drive.acceleration_m_s2
    limited = speed.tolist()
    limited[-1] = 0.0
    for i in range(len(limited) - 2, -1, -1):
        limited[i] = min(limited[i], (limited[i + 1] ** 2 + 2.0 * braking * lengths[i]) ** 0.5)
    return np.array(limited)


def _headings(path: Array, grid: Grid, facing: float, *, faces_goal: bool) -> Array:
    """Return the heading [rad] at each point: along the path, or as at the goal.

    A base that faces as at the goal drives through narrow places along the path all the same,
    ahead or astern: it's longer than it's wide.
    """
    ahead = np.concatenate([np.diff(path, axis=0), path[-1:] - path[-2:-1]])
    along = np.arctan2(ahead[:, 1], ahead[:, 0])
    lengths = np.hypot(*np.diff(path, axis=0).T)
    points = max(int(_ROOM_AROUND_M / lengths[0]), 1)
    roomy = minimum_filter1d(grid.clearance_at(*path.T), 2 * points + 1) >= _TURNING_ROOM_M
    left_m = lengths.sum() - np.concatenate([[0.0], np.cumsum(lengths)])
    arriving = roomy & (left_m <= _LAST_STRETCH_M)
    if not faces_goal:
        return np.where(arriving, facing, along)
    astern = np.cos(along - facing) < 0.0
    return np.where(roomy, facing, along + np.pi * astern)
