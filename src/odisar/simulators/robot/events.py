"""Disturbances of the motion itself: a slippery floor, a blocked passage, people in the way.

All are laid on the planned path, after the first waypoint and before the last leg.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from odisar.config.robot import BlockedConfig, PeopleConfig, RobotSimulatorConfig, SlipConfig
from odisar.simulators.robot.grid import Array, Grid
from odisar.simulators.robot.legs import Leg, Task, braked, plan_leg
from odisar.simulators.robot.motion import SlipPatch
from odisar.simulators.robot.office import draw
from odisar.simulators.robot.people import Crossing, draw_crossing
from odisar.simulators.robot.planning import Planner

_PLACES_TRIED = 8
#: A slippery patch and a blockage keep this far from the ends of a leg [m].
_FROM_ENDS_M = 1.5
#: A patch lies where there's room to be pulled aside [m].
_SLIP_ROOM_M = 0.75


@dataclass(frozen=True)
class Blockage:
    """A blocked passage: the office with it, from the start of leg ``since_leg`` on.

    ``seen`` and ``passed`` are the points (leg, point) between which the base is disturbed;
    ``legs`` are those of the whole task, with a stop before the blockage and the detour.
    """

    grid: Grid
    since_leg: int
    seen: tuple[int, int]
    passed: tuple[int, int]
    legs: list[Leg]
    detour_m: float


def place_patch(
    stream: np.random.Generator, legs: Sequence[Leg], grid: Grid, strength: float, slip: SlipConfig
) -> SlipPatch | None:
    """Return a patch that the path crosses; None if this draw found no room for one."""
    leg = legs[_draw_leg(stream, legs)]
    place, side = stream.random(), 1.0 if stream.random() < 0.5 else -1.0
    along = leg.along_m
    margin_m = slip.radius_m + _FROM_ENDS_M
    inside = (along >= margin_m) & (along <= along[-1] - margin_m)
    points = np.flatnonzero(inside & (grid.clearance_at(*leg.path.T) >= _SLIP_ROOM_M))
    if not len(points):
        return None
    point = int(points[int(place * len(points))])
    ahead = leg.path[point + 1] - leg.path[point]
    aside = side * strength * slip.pull_m_s * np.array([-ahead[1], ahead[0]]) / np.hypot(*ahead)
    return SlipPatch(
        centre=(float(leg.path[point, 0]), float(leg.path[point, 1])),
        radius_m=slip.radius_m,
        loss=strength * slip.loss,
        pull=(float(aside[0]), float(aside[1])),
        turn_rad_s=side * strength * slip.turn_rad_s,
    )


def place_crossings(
    stream: np.random.Generator, legs: Sequence[Leg], grid: Grid, people: PeopleConfig
) -> list[Crossing]:
    """Return people who cross the path; fewer than drawn where there's no room."""
    found = []
    for _ in range(round(draw(stream, people.crossings))):
        number = _draw_leg(stream, legs)
        crossing = draw_crossing(stream, number, legs[number], grid, people)
        if crossing is not None:
            found.append(crossing)
    return found


def place_blockage(
    stream: np.random.Generator,
    task: Task,
    legs: Sequence[Leg],
    grid: Grid,
    config: RobotSimulatorConfig,
) -> Blockage | None:
    """Return a blocked passage with a way round; None if this draw found none."""
    blocked = config.disturbances.blocked
    number = _draw_leg(stream, legs)
    leg, along = legs[number], legs[number].along_m
    margin_m = blocked.sight_m + _FROM_ENDS_M
    inside = (along >= margin_m) & (along <= along[-1] - _FROM_ENDS_M)
    points = np.flatnonzero(inside & (grid.clearance_at(*leg.path.T) <= blocked.passage_m))
    stand_s = draw(stream, blocked.stand_s)
    for point in stream.permutation(points)[:_PLACES_TRIED]:
        ahead = leg.path[point + 1] - leg.path[point - 1]
        half_sides = (blocked.half_depth_m, blocked.half_length_m)
        changed = grid.with_box(leg.path[point], float(np.arctan2(ahead[1], ahead[0])), half_sides)
        found = _way_round(task, legs, (number, int(point)), stand_s, changed, config)
        if found is not None:
            return found
    return None


def _way_round(
    task: Task,
    legs: Sequence[Leg],
    at: tuple[int, int],
    stand_s: float,
    changed: Grid,
    config: RobotSimulatorConfig,
) -> Blockage | None:
    """Return the task with a stop before a blockage and a detour, if there's a fitting one."""
    blocked, (number, point) = config.disturbances.blocked, at
    leg, along = legs[number], legs[number].along_m
    seen, stop = (
        int(np.searchsorted(along, along[point] - distance_m))
        for distance_m in (blocked.sight_m, blocked.stop_m)
    )
    planner = Planner(changed, config.planner)
    ends = [leg.path[stop], *task.points[number + 1 :]]
    if not all(planner.reaches(end) for end in ends) or _meets(leg.path[:seen], leg.path[point]):
        return None
    detour = plan_leg(task, number, leg.path[stop], changed, planner, config)
    longer_m = float(detour.along_m[-1] - (along[-1] - along[stop]))
    if not blocked.detour_m.low <= longer_m <= blocked.detour_m.high:
        return None
    rest = [
        plan_leg(task, i, task.points[i], changed, planner, config)
        for i in range(number + 1, len(legs))
    ]
    before = _stopped(leg, seen, stop, stand_s, config)
    return Blockage(
        grid=changed,
        since_leg=number,
        seen=(number, seen),
        passed=(number + 1, int(np.searchsorted(detour.along_m, blocked.clear_m))),
        legs=[*legs[:number], before, detour, *rest],
        detour_m=longer_m,
    )


def _meets(path: Array, place: Array) -> bool:
    """Return whether a path comes near a place before it's said to be seen."""
    return bool(np.hypot(*(path - place).T).min() < _FROM_ENDS_M)


def _stopped(leg: Leg, seen: int, stop: int, stand_s: float, config: RobotSimulatorConfig) -> Leg:
    """Return the leg up to a stop, slower from where the blockage is seen."""
    blocked: BlockedConfig = config.disturbances.blocked
    speed = leg.speed[: stop + 1].copy()
    speed[seen:] = np.minimum(speed[seen:], blocked.approach_m_s)
    lengths = np.diff(leg.along_m)[:stop]
    # Not braked for what isn't seen yet: only from there on.
    speed[seen:] = braked(speed[seen:], lengths[seen:], config.drive)
    return replace(
        leg,
        path=leg.path[: stop + 1],
        speed=speed,
        heading=leg.heading[: stop + 1],
        facing=None,
        stand_s=stand_s,
        waypoint=False,
    )


def _draw_leg(stream: np.random.Generator, legs: Sequence[Leg]) -> int:
    """Draw a leg after the first waypoint, but not the last one if there are others."""
    return int(stream.integers(1, max(len(legs) - 1, 2)))
