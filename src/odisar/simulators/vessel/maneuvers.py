"""Manoeuvres: what thruster angle the bridge orders.

Turning circles and random steering are scheduled ahead; a zigzag reacts to the heading. A
positive angle turns the ship to port, as in R/V Gunnerus' recorded trials.
"""

import numpy as np

from odisar.config.simulators import ManeuversConfig, RandomSteering
from odisar.simulators.vessel.fleet import RunPlan
from odisar.simulators.vessel.hull import Array
from odisar.simulators.vessel.voyage import Voyage


def scheduled_angle(
    plan: RunPlan,
    voyage: Voyage,
    config: ManeuversConfig,
    time_s: Array,
    stream: np.random.Generator,
) -> Array:
    """Return the angle [deg] (step,) ordered ahead of time; zero for a zigzag."""
    if plan.maneuver == "turning":
        angle = voyage.side * float(plan.variant) * np.ones_like(time_s)
    elif plan.maneuver == "random":
        angle = _random_angle(config.random[plan.variant], voyage, time_s, stream)
    else:
        angle = np.zeros_like(time_s)
    return np.asarray(np.where(time_s >= voyage.maneuver_start_s, angle, 0.0))


def _random_angle(
    steering: RandomSteering, voyage: Voyage, time_s: Array, stream: np.random.Generator
) -> Array:
    span_s = time_s[-1] - voyage.maneuver_start_s
    holds = int(np.ceil(span_s / steering.hold_s.low)) + 1
    lengths = stream.uniform(steering.hold_s.low, steering.hold_s.high, holds)
    angles = stream.uniform(-steering.max_angle_deg, steering.max_angle_deg, holds)
    changes = voyage.maneuver_start_s + np.cumsum(lengths)
    # Whole degrees, as on a bridge.
    hold = np.searchsorted(changes, time_s, side="right").clip(max=holds - 1)
    return np.asarray(np.round(angles[hold]))


class Helm:
    """The ordered angles of all runs, step by step.

    ``schedule`` is (step, run) in degrees; ``zigzag_deg`` (run,) is the angle of a zigzag or zero,
    ``side`` (run,) the sign of its first order and ``start_s`` (run,) when it begins.
    """

    def __init__(self, schedule: Array, zigzag_deg: Array, side: Array, start_s: Array) -> None:
        self._schedule = schedule
        self._zigzag_deg = zigzag_deg
        self._side = side.copy()
        self._start_s = start_s
        self._base_heading = np.zeros_like(side)

    def order(self, step: int, time_s: float, heading: Array) -> Array:
        """Return the ordered angle [deg] (run,) at a heading [rad] (run,)."""
        running = time_s >= self._start_s
        self._base_heading = np.where(running, self._base_heading, heading)
        turned = np.rad2deg(heading - self._base_heading)
        # A positive order turns to port: it has done its work once the heading fell by the angle.
        done = running & (-self._side * turned >= self._zigzag_deg)
        self._side = np.where(done, -self._side, self._side)
        zigzag_deg = np.where(running, self._side * self._zigzag_deg, 0.0)
        return np.asarray(zigzag_deg + self._schedule[step])
