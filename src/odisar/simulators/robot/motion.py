"""What a driven task is: the motion, the wheels that made it, and a floor that let them slip."""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from odisar.config.robot import RobotSimulatorConfig
from odisar.simulators.robot.grid import Array
from odisar.simulators.robot.people import Crossing


@dataclass(frozen=True)
class SlipPatch:
    """A slippery place: wheels lose ``loss`` of their way, the base is pulled and turned aside."""

    centre: tuple[float, float]
    radius_m: float
    loss: float
    pull: tuple[float, float]
    turn_rad_s: float


@dataclass(frozen=True)
class Motion:
    """What happened, at ``time_s`` (step,).

    ``pose`` (step, 3) is true: x, y [m] and unwrapped yaw [rad]. ``twist`` (step, 3) is of the
    wheels, in the base's axes [m/s, m/s, rad/s]. ``leg`` and ``point`` (step,) say how far the
    base has come, ``reacts`` and ``slips`` (step,) what it meets. ``arrivals_s`` are the times at
    the waypoints, ``met`` the crossings and when they began.
    """

    time_s: Array
    pose: Array
    twist: Array
    leg: Array
    point: Array
    reacts: Array
    slips: Array
    arrivals_s: tuple[float, ...]
    met: tuple[tuple[Crossing, float], ...]

    @property
    def duration_s(self) -> float:
        """Time of the last step."""
        return float(self.time_s[-1])

    def time_at(self, leg: int, point: int) -> float:
        """Return when the base came to a point of a leg."""
        passed = (self.leg > leg) | ((self.leg == leg) & (self.point >= point))
        return float(self.time_s[int(np.argmax(passed))])


@dataclass(frozen=True)
class Wheels:
    """How a task's wheels differ from ideal ones.

    ``scale`` (3,) is the way made over the way counted, ahead, aside and in yaw; ``ripple``
    (step, 3) a unit-variance disturbance of the speed, from step to step.
    """

    scale: Array
    ripple: Array


def draw_wheels(
    stream: np.random.Generator, config: RobotSimulatorConfig, duration_s: float
) -> Wheels:
    """Draw a task's wheels; a ripple is a first-order Gauss-Markov process."""
    drive = config.drive
    scale = 1.0 + np.array(config.base.scale_error_sd) * stream.standard_normal(3)
    steps = int(duration_s / drive.step_s) + 1
    memory = float(np.exp(-drive.step_s / drive.ripple_s))
    fresh = sqrt(1.0 - memory**2) * stream.standard_normal((steps, 3))
    ripple = np.empty((steps, 3))
    state = np.zeros(3)
    for step in range(steps):
        state = memory * state + fresh[step]
        ripple[step] = state
    return Wheels(scale, ripple)
