"""A task as it was driven, with whatever disturbed its motion."""

from dataclasses import dataclass
from math import inf

import numpy as np

from odisar.config.robot import RobotSimulatorConfig
from odisar.errors import OdisarError
from odisar.seeding import generator
from odisar.simulators.robot.drive import drive_task
from odisar.simulators.robot.events import (
    Blockage,
    place_blockage,
    place_crossings,
    place_patch,
)
from odisar.simulators.robot.fleet import TaskPlan
from odisar.simulators.robot.grid import Array, Grid
from odisar.simulators.robot.legs import Leg, Task, draw_task, plan_legs
from odisar.simulators.robot.motion import Motion, SlipPatch, Wheels, draw_wheels
from odisar.simulators.robot.planning import Planner

#: Points along each side of the footprint that must stay free.
_OUTLINE_POINTS = 9
#: Stretches of a disturbance with a shorter pause [s] between them are one ...
_PAUSE_S = 2.0
#: ... and a task with a shorter one than this [s] is drawn again: it hardly happened.
_SHORTEST_S = 1.0


@dataclass(frozen=True)
class Journey:
    """What became of a task.

    ``spans_s`` are the stretches (start, end) [s] in which the motion, or the odometry, is
    disturbed; ``grid`` is the office, ``changed`` the office from ``changed_s`` on.
    """

    task: Task
    legs: list[Leg]
    motion: Motion
    wheels: Wheels
    spans_s: list[tuple[float, float]]
    grid: Grid
    changed: Grid
    changed_s: float
    detail: str = ""


def run_stream(base_seed: int, plan: TaskPlan, purpose: str) -> np.random.Generator:
    """Return the random numbers of one task for one purpose, whatever other tasks there are."""
    return generator(base_seed, "simulators", "robot", plan.seed_name, purpose)


class JourneyMaker:
    """Makes journeys through one office."""

    def __init__(self, grid: Grid, config: RobotSimulatorConfig, base_seed: int) -> None:
        self.grid = grid
        self._config = config
        self._base_seed = base_seed
        self._planner = Planner(grid, config.planner)

    def make(self, plan: TaskPlan, strength: float | None) -> Journey:
        """Return the first drawn task that is as long as it must be and has room for its event.

        Every kind of task has room for every event in the odometry, so that undisturbed and
        disturbed tasks are drawn alike. Raises OdisarError where no draw will do.
        """
        config = self._config
        longest_s = config.task.duration_s.high
        wheels = draw_wheels(run_stream(self._base_seed, plan, "wheels"), config, longest_s)
        for attempt in range(config.task.attempts):
            stream = run_stream(self._base_seed, plan, f"task-{attempt}")
            journey = self._planned(plan, stream, wheels)
            if journey is not None:
                journey = self._disturbed(plan, strength, journey, stream)
            if journey is not None and self._is_allowed(journey):
                return journey
        raise OdisarError(
            f"robot simulator: none of {config.task.attempts} draws of task {plan.seed_name!r} "
            "fits; widen simulators.robot.task.duration_s, lower separation_m, or raise attempts"
        )

    def _planned(
        self, plan: TaskPlan, stream: np.random.Generator, wheels: Wheels
    ) -> Journey | None:
        config = self._config
        task = draw_task(stream, self._planner, config)
        if len(task.points) <= config.task.waypoints:
            return None
        legs = plan_legs(task, self.grid, self._planner, config)
        motion = drive_task(task, legs, wheels, config)
        if motion is None or motion.duration_s < config.task.duration_s.low:
            return None
        disturbances = config.disturbances
        start_s = motion.arrivals_s[0]
        end_s = start_s + disturbances.duration_s
        if end_s + disturbances.quiet_s > motion.duration_s:
            return None
        in_odometry = plan.disturbance in ("noise", "correlated-noise", "bias", "drift")
        spans_s = [(start_s, end_s)] if in_odometry else []
        return Journey(task, legs, motion, wheels, spans_s, self.grid, self.grid, inf)

    def _disturbed(
        self,
        plan: TaskPlan,
        strength: float | None,
        journey: Journey,
        stream: np.random.Generator,
    ) -> Journey | None:
        if plan.disturbance == "slip":
            return self._slipping(journey, stream, 1.0 if strength is None else strength)
        if plan.disturbance == "blocked":
            return self._blocked(journey, stream)
        if plan.disturbance == "people":
            return self._among_people(journey, stream)
        return journey

    def _slipping(
        self, journey: Journey, stream: np.random.Generator, strength: float
    ) -> Journey | None:
        slip = self._config.disturbances.slip
        patch = place_patch(stream, journey.legs, self.grid, strength, slip)
        if patch is None:
            return None
        motion = drive_task(journey.task, journey.legs, journey.wheels, self._config, patch=patch)
        if motion is None:
            return None
        return self._with(journey, motion, _stretches(motion, motion.slips), _told(patch))

    def _among_people(self, journey: Journey, stream: np.random.Generator) -> Journey | None:
        people = self._config.disturbances.people
        crossings = place_crossings(stream, journey.legs, self.grid, people)
        motion = drive_task(
            journey.task, journey.legs, journey.wheels, self._config, crossings=crossings
        )
        if motion is None:
            return None
        detail = f"{len(motion.met)} people crossed"
        return self._with(journey, motion, _stretches(motion, motion.reacts), detail)

    def _blocked(self, journey: Journey, stream: np.random.Generator) -> Journey | None:
        found = place_blockage(stream, journey.task, journey.legs, self.grid, self._config)
        if found is None:
            return None
        motion = drive_task(journey.task, found.legs, journey.wheels, self._config)
        if motion is None:
            return None
        span_s = (motion.time_at(*found.seen), motion.time_at(*found.passed))
        detail = f"{found.detour_m:.1f} m longer"
        return self._with(journey, motion, [span_s], detail, found)

    def _with(
        self,
        journey: Journey,
        motion: Motion,
        spans_s: list[tuple[float, float]],
        detail: str,
        blockage: Blockage | None = None,
    ) -> Journey:
        return Journey(
            task=journey.task,
            legs=blockage.legs if blockage else journey.legs,
            motion=motion,
            wheels=journey.wheels,
            spans_s=spans_s,
            grid=self.grid,
            changed=blockage.grid if blockage else self.grid,
            changed_s=motion.time_at(blockage.since_leg, 0) if blockage else inf,
            detail=detail,
        )

    def _is_allowed(self, journey: Journey) -> bool:
        """Return whether nothing was touched and any event came in its time."""
        if footprint_touches(journey, self._config):
            return False
        if not journey.spans_s:
            # Undisturbed, unless nobody came so near that the base had to react.
            return not journey.detail
        if min(end_s - start_s for start_s, end_s in journey.spans_s) < _SHORTEST_S:
            return False
        quiet_s = self._config.disturbances.quiet_s
        first_s, last_s = journey.spans_s[0][0], journey.spans_s[-1][1]
        after_waypoint = first_s >= journey.motion.arrivals_s[0]
        return after_waypoint and last_s + quiet_s <= journey.motion.duration_s


def footprint_touches(journey: Journey, config: RobotSimulatorConfig) -> bool:
    """Return whether the base's outline ever lies over something."""
    x, y = outline(journey.motion.pose, config.base.length_m, config.base.width_m)
    later = journey.motion.time_s >= journey.changed_s
    return bool(
        journey.grid.is_occupied(x, y).any()
        or journey.changed.is_occupied(x[later], y[later]).any()
    )


def outline(pose: Array, length_m: float, width_m: float) -> tuple[Array, Array]:
    """Return points x and y (pose, point) [m] around the footprint at each ``pose`` (pose, 3)."""
    run = np.linspace(-0.5, 0.5, _OUTLINE_POINTS)
    end = np.full(_OUTLINE_POINTS, 0.5)
    ahead = length_m * np.concatenate([run, run, end, -end])
    aside = width_m * np.concatenate([end, -end, run, run])
    cos, sin = np.cos(pose[:, 2:3]), np.sin(pose[:, 2:3])
    return pose[:, 0:1] + ahead * cos - aside * sin, pose[:, 1:2] + ahead * sin + aside * cos


def _stretches(motion: Motion, flags: Array) -> list[tuple[float, float]]:
    """Return where flags (step,) are up but for short pauses, as (start, end) [s]."""
    edges = np.diff(np.concatenate([[0.0], flags, [0.0]]))
    starts, stops = np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)
    ends_s = np.append(motion.time_s, motion.duration_s)
    found: list[tuple[float, float]] = []
    for start, stop in zip(starts, stops, strict=True):
        start_s, end_s = float(motion.time_s[start]), float(ends_s[stop])
        if found and start_s - found[-1][1] < _PAUSE_S:
            found[-1] = (found[-1][0], end_s)
        else:
            found.append((start_s, end_s))
    return found


def _told(patch: SlipPatch) -> str:
    x, y = patch.centre
    return f"patch of {patch.radius_m:g} m at ({x:.1f}, {y:.1f}), loss {patch.loss:g}"
