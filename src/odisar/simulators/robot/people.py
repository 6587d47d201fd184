"""People who step into the base's way: where they walk, and how fast the base may drive."""

from dataclasses import dataclass
from math import hypot

import numpy as np

from odisar.config.robot import PeopleConfig
from odisar.simulators.robot.grid import Array, Grid
from odisar.simulators.robot.legs import Leg
from odisar.simulators.robot.office import draw

#: A person this far aside of the base's course [m] is none of its business ...
_COURSE_M = 0.85
#: ... and neither is one this far behind [m].
_BEHIND_M = 0.1


@dataclass(frozen=True)
class Crossing:
    """A person walks from ``start`` to ``middle``, lingers, and walks on to ``end`` and away.

    Begins when the base comes to point ``trigger`` of leg ``leg``. Times count from then.
    """

    leg: int
    trigger: int
    start: tuple[float, float]
    middle: tuple[float, float]
    end: tuple[float, float]
    arrive_s: float
    leave_s: float
    gone_s: float

    def at(self, since_s: float) -> tuple[float, float]:
        """Return where the person is."""
        if since_s <= self.arrive_s:
            return _between(self.start, self.middle, since_s / self.arrive_s)
        if since_s <= self.leave_s:
            return self.middle
        share = (since_s - self.leave_s) / (self.gone_s - self.leave_s)
        return _between(self.middle, self.end, min(share, 1.0))


def draw_crossing(
    stream: np.random.Generator, leg_number: int, leg: Leg, grid: Grid, config: PeopleConfig
) -> Crossing | None:
    """Draw where a person crosses a leg; None where there's no room to step aside."""
    along = leg.along_m
    trigger_m, walk = draw(stream, config.trigger_m), draw(stream, config.walk_m_s)
    linger_s, place, side = draw(stream, config.linger_s), stream.random(), stream.random()
    first, last = 1.5 + trigger_m, along[-1] - 1.5
    if first >= last:
        return None
    point = int(np.searchsorted(along, first + place * (last - first)))
    middle = leg.path[point]
    ahead = leg.path[point] - leg.path[point - 1]
    aside = np.array([-ahead[1], ahead[0]]) / np.hypot(*ahead) * (1.0 if side < 0.5 else -1.0)
    reach = [_free_m(grid, middle, way, config) for way in (aside, -aside)]
    if min(reach) <= 0.3:
        return None
    arrive_s = reach[0] / walk
    leave_s = arrive_s + linger_s
    return Crossing(
        leg=leg_number,
        trigger=int(np.searchsorted(along, along[point] - trigger_m)),
        start=_pair(middle + reach[0] * aside),
        middle=_pair(middle),
        end=_pair(middle - reach[1] * aside),
        arrive_s=arrive_s,
        leave_s=leave_s,
        gone_s=leave_s + reach[1] / walk,
    )


def speed_limit(
    base: tuple[float, float],
    course: tuple[float, float],
    person: tuple[float, float],
    reach_m: float,
    config: PeopleConfig,
) -> float:
    """Return the share of its speed at which a base may drive on its course (a unit vector).

    ``reach_m`` is from the base's centre to its front. One means that the person isn't in the way.
    """
    x, y = person[0] - base[0], person[1] - base[1]
    ahead, aside = x * course[0] + y * course[1], abs(y * course[0] - x * course[1])
    if ahead < -_BEHIND_M or aside > _COURSE_M:
        return 1.0
    gap = hypot(x, y) - reach_m - config.radius_m
    return min(max((gap - config.stop_m) / (config.slow_m - config.stop_m), 0.0), 1.0)


def _free_m(grid: Grid, start: Array, way: Array, config: PeopleConfig) -> float:
    """Return how far a person can step from ``start``: up to ``reach_m``, or to a wall."""
    reach = np.arange(0.0, config.reach_m, grid.resolution_m)
    clear = grid.clearance_at(start[0] + reach * way[0], start[1] + reach * way[1])
    blocked = np.flatnonzero(clear < config.radius_m)
    return float(reach[blocked[0] - 1] if len(blocked) and blocked[0] else reach[-1])


def _between(a: tuple[float, float], b: tuple[float, float], share: float) -> tuple[float, float]:
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])


def _pair(point: Array) -> tuple[float, float]:
    return float(point[0]), float(point[1])
