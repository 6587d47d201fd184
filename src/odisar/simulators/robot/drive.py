"""Drive a task: a holonomic controller with limits, on the floor as it is.

The controller knows the true pose, as if localised without error. Wheels turn as they're told
within their limits; the base moves as the wheels turn, less what slips.
"""

from collections.abc import Sequence
from math import atan2, cos, hypot, pi, sin, sqrt

import numpy as np

from odisar.config.robot import RobotSimulatorConfig
from odisar.errors import OdisarError
from odisar.simulators.robot.legs import Leg, Task
from odisar.simulators.robot.motion import Motion, SlipPatch, Wheels
from odisar.simulators.robot.people import Crossing, speed_limit

#: Slower than this [m/s] a base doesn't creep on its way to a goal.
_CREEP_M_S = 0.05
#: Gain from the error in heading to the yaw rate [1/s].
_HEADING_GAIN = 2.0
#: A base that reacts to people does so until it's back at this share of its speed.
_BACK_AT_SPEED = 0.9
#: Below these a base stands [m/s, rad/s].
_STANDING = 0.005


def drive_task(
    task: Task,
    legs: Sequence[Leg],
    wheels: Wheels,
    config: RobotSimulatorConfig,
    patch: SlipPatch | None = None,
    crossings: Sequence[Crossing] = (),
) -> Motion | None:
    """Return the motion of a task; None if it takes longer than a task may."""
    driver = _Driver(task, wheels, config, patch, crossings)
    try:
        driver.stand(float(task.stands_s[0]))
        for number, leg in enumerate(legs):
            driver.follow(number, leg)
            driver.turn_to(leg.facing)
            driver.arrive(leg)
            driver.stand(leg.stand_s)
    except _TookTooLongError:
        return None
    return driver.motion()


class _TookTooLongError(OdisarError):
    """The task isn't over when its time is."""


class _Driver:
    """The base in motion. Plain floats: a step is too small for arrays."""

    def __init__(
        self,
        task: Task,
        wheels: Wheels,
        config: RobotSimulatorConfig,
        patch: SlipPatch | None,
        crossings: Sequence[Crossing],
    ) -> None:
        drive = config.drive
        self._drive, self._people = drive, config.disturbances.people
        self._dt = drive.step_s
        self._x, self._y = (float(value) for value in task.points[0])
        self._yaw = float(task.facing[0])
        self._vx = self._vy = self._wz = 0.0
        self._scale = tuple(wheels.scale.tolist())
        self._ripple = (drive.ripple * wheels.ripple).tolist()
        self._patch = patch
        self._waiting, self._met = list(crossings), list[tuple[Crossing, float]]()
        self._front_m = 0.5 * config.base.length_m
        self._leg = self._point = 0
        self._reacts = False
        self._rows: list[tuple[float, ...]] = []
        self._arrivals_s: list[float] = []

    @property
    def _now_s(self) -> float:
        return len(self._rows) * self._dt

    def motion(self) -> Motion:
        """Return what has happened."""
        table = np.array(self._rows)
        return Motion(
            time_s=np.arange(len(table), dtype=np.float64) * self._dt,
            pose=table[:, 0:3],
            twist=table[:, 3:6],
            leg=table[:, 6],
            point=table[:, 7],
            reacts=table[:, 8],
            slips=table[:, 9],
            arrivals_s=tuple(self._arrivals_s),
            met=tuple(self._met),
        )

    def arrive(self, leg: Leg) -> None:
        """Note a waypoint."""
        if leg.waypoint:
            self._arrivals_s.append(self._now_s)

    def stand(self, seconds: float) -> None:
        """Stand for a while."""
        for _ in range(round(seconds / self._dt)):
            self._step(0.0, 0.0, 0.0)

    def turn_to(self, facing: float | None) -> None:
        """Come to rest, facing as at the goal."""
        while True:
            error = 0.0 if facing is None else _wrapped(facing - self._yaw)
            settled = abs(error) < self._drive.goal_tolerance_rad
            if settled and max(abs(self._vx), abs(self._vy), abs(self._wz)) < _STANDING:
                return
            self._step(0.0, 0.0, 0.0 if settled else self._yaw_rate(error))

    def follow(self, number: int, leg: Leg) -> None:
        """Drive along a leg to within the tolerance of its end."""
        self._leg, self._point = number, 0
        xs, ys = leg.path[:, 0].tolist(), leg.path[:, 1].tolist()
        speeds, headings = leg.speed.tolist(), leg.heading.tolist()
        last = len(xs) - 1
        reach = max(round(self._drive.lookahead_m / float(leg.along_m[1])), 1)
        while True:
            self._advance(xs, ys)
            left_m = hypot(xs[last] - self._x, ys[last] - self._y)
            if self._point >= last - 2 and left_m < self._drive.goal_tolerance_m:
                return
            target = min(self._point + reach, last)
            error = _wrapped(headings[target] - self._yaw)
            speed = max(speeds[self._point], _CREEP_M_S)
            dx, dy = xs[target] - self._x, ys[target] - self._y
            self._move(dx, dy, speed, error)

    def _advance(self, xs: list[float], ys: list[float]) -> None:
        """Move on to the point of the path that's nearest from here on."""
        i, last = self._point, len(xs) - 1
        here = hypot(xs[i] - self._x, ys[i] - self._y)
        while i < last:
            there = hypot(xs[i + 1] - self._x, ys[i + 1] - self._y)
            if there > here:
                break
            i, here = i + 1, there
        self._point = i

    def _move(self, dx: float, dy: float, speed: float, error: float) -> None:
        """Take a step towards a point that's (dx, dy) away, with an error in heading."""
        distance = max(hypot(dx, dy), 1e-9)
        # A base that faces elsewhere turns first, more or less.
        speed *= max(1.0 - abs(error) / (0.6 * pi), 0.2)
        course = (dx / distance, dy / distance)
        if self._waiting or self._met:
            speed = self._heed_people(course, speed)
        cos_yaw, sin_yaw = cos(self._yaw), sin(self._yaw)
        self._step(
            speed * (course[0] * cos_yaw + course[1] * sin_yaw),
            speed * (course[1] * cos_yaw - course[0] * sin_yaw),
            self._yaw_rate(error),
        )

    def _heed_people(self, course: tuple[float, float], speed: float) -> float:
        now_s = self._now_s
        for crossing in [c for c in self._waiting if self._has_come_to(c)]:
            self._waiting.remove(crossing)
            self._met.append((crossing, now_s))
        share = 1.0
        for crossing, begun_s in self._met:
            if now_s - begun_s < crossing.gone_s:
                person = crossing.at(now_s - begun_s)
                here = (self._x, self._y)
                share = min(share, speed_limit(here, course, person, self._front_m, self._people))
        was_slowed = self._reacts and hypot(self._vx, self._vy) < _BACK_AT_SPEED * speed
        self._reacts = share < 1.0 or was_slowed
        return share * speed

    def _has_come_to(self, crossing: Crossing) -> bool:
        return self._leg == crossing.leg and self._point >= crossing.trigger

    def _yaw_rate(self, error: float) -> float:
        """Return the yaw rate that removes an error in heading and can be stopped in time."""
        drive = self._drive
        braking = drive.braking_share * drive.yaw_acceleration_rad_s2
        rate = min(_HEADING_GAIN * abs(error), sqrt(2.0 * braking * abs(error)))
        return min(rate, drive.yaw_rate_rad_s) * (1.0 if error >= 0.0 else -1.0)

    def _step(self, vx: float, vy: float, wz: float) -> None:
        """Let the wheels follow a command for one step, and the base the wheels."""
        self._log()
        speed, turning = hypot(self._vx, self._vy), abs(self._wz)
        ripple = self._ripple[len(self._rows)]
        share = self._dt / self._drive.lag_s
        ax = share * (vx + speed * ripple[0] - self._vx)
        ay = share * (vy + speed * ripple[1] - self._vy)
        aw = share * (wz + turning * ripple[2] - self._wz)
        limit = self._drive.acceleration_m_s2 * self._dt
        shrink = min(limit / max(hypot(ax, ay), limit), 1.0)
        turn_limit = self._drive.yaw_acceleration_rad_s2 * self._dt
        before = (self._vx, self._vy, self._wz)
        self._vx += shrink * ax
        self._vy += shrink * ay
        self._wz += min(max(aw, -turn_limit), turn_limit)
        if not (vx or vy or wz):
            self._come_to_rest()
        self._make_way(before)

    def _come_to_rest(self) -> None:
        """Hold the wheels once they're told to stand and hardly turn: a lag alone never ends."""
        if max(hypot(self._vx, self._vy), abs(self._wz)) < 0.5 * _STANDING:
            self._vx = self._vy = self._wz = 0.0

    def _make_way(self, before: tuple[float, float, float]) -> None:
        vx = 0.5 * (before[0] + self._vx) * self._scale[0]
        vy = 0.5 * (before[1] + self._vy) * self._scale[1]
        wz = 0.5 * (before[2] + self._wz) * self._scale[2]
        east = north = 0.0
        if self._patch is not None and self._is_on_patch():
            patch, moving = self._patch, min(hypot(vx, vy) / 0.3, 1.0)
            vx, vy = (1.0 - patch.loss) * vx, (1.0 - patch.loss) * vy
            wz = (1.0 - patch.loss) * wz + moving * patch.turn_rad_s
            east, north = moving * patch.pull[0], moving * patch.pull[1]
        middle = self._yaw + 0.5 * wz * self._dt
        self._x += self._dt * (vx * cos(middle) - vy * sin(middle) + east)
        self._y += self._dt * (vx * sin(middle) + vy * cos(middle) + north)
        self._yaw += wz * self._dt

    def _is_on_patch(self) -> bool:
        patch = self._patch
        return (
            patch is not None
            and hypot(self._x - patch.centre[0], self._y - patch.centre[1]) < patch.radius_m
        )

    def _log(self) -> None:
        if len(self._rows) >= len(self._ripple) - 1:
            raise _TookTooLongError("a task takes longer than task.duration_s.high")
        pose = (self._x, self._y, self._yaw, self._vx, self._vy, self._wz)
        self._rows.append(
            (*pose, self._leg, self._point, float(self._reacts), float(self._is_on_patch()))
        )


def _wrapped(angle: float) -> float:
    return atan2(sin(angle), cos(angle))
