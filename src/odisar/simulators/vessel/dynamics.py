"""Equations of motion in surge, sway, roll and yaw, for any number of runs at once.

Source: NTNU's public four-degree-of-freedom manoeuvring model of R/V Gunnerus (NTNU-MCS,
MCSim_python); notation after T. I. Fossen, "Handbook of Marine Craft Hydrodynamics and Motion
Control", 2011. Velocities in the forces are relative to the water.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from odisar.simulators.vessel.hull import WATER_DENSITY, Array, Hull, Thruster

#: Rows of a state array (row, run): north and east [m], roll (positive with port down) and
#: heading [rad], surge and sway over ground in body axes [m/s], roll and yaw rate [rad/s],
#: azimuth angle [rad] and propeller speed [RPM].
STATE_ROWS = ("north", "east", "roll", "heading", "u", "v", "p", "r", "azimuth", "rpm")

_FOIL_WATER_DENSITY = 1000.0
_CROSS_FLOW_POINTS = 15


@dataclass(frozen=True)
class Force:
    """Forces [N] and moments about the centre of gravity [N m], each (run,)."""

    surge: Array
    sway: Array
    roll: Array
    yaw: Array

    def __add__(self, other: "Force") -> "Force":
        return Force(
            self.surge + other.surge,
            self.sway + other.sway,
            self.roll + other.roll,
            self.yaw + other.yaw,
        )


def no_force(runs: int) -> Force:
    """Return zero force for each of ``runs`` runs."""
    zero = np.zeros(runs)
    return Force(zero, zero, zero, zero)


class Motion(NamedTuple):
    """Motion through the water: surge and sway [m/s], roll and yaw rate [rad/s], each (run,)."""

    u: Array
    v: Array
    p: Array
    r: Array


class Orders(NamedTuple):
    """What the bridge orders: azimuth angle [rad] and propeller speed [RPM], each (run,)."""

    azimuth: Array
    rpm: Array


class Current(NamedTuple):
    """Velocity of the water to the north and to the east [m/s], each (run,)."""

    north: Array
    east: Array

    def in_body_axes(self, heading: Array) -> tuple[Array, Array]:
        """Return the current along and across a ship with this heading [m/s]."""
        cos, sin = np.cos(heading), np.sin(heading)
        return self.north * cos + self.east * sin, self.east * cos - self.north * sin


def ordered_sum(terms: Array) -> Array:
    """Sum (term, run) over terms, first to last.

    ``np.sum`` may add in another order when there's one run, and then the bits would depend on
    how many runs are made together.
    """
    total: Array = terms[0].copy()
    for term in terms[1:]:
        total += term
    return total


def wrap(angle: Array) -> Array:
    """Return the angle [rad] in [-pi, pi)."""
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def advance(
    hull: Hull,
    state: Array,
    orders: Orders,
    current: Current,
    weather: tuple[Force, Force, Force],
    step_s: float,
) -> Array:
    """Return the state (row, run) one Runge-Kutta step of fourth order later.

    ``weather`` is the force of wind and waves at the beginning, middle and end of the step;
    orders and current are held over it.
    """
    begin, middle, end = weather
    k1 = derivative(hull, state, orders, current, begin)
    k2 = derivative(hull, state + 0.5 * step_s * k1, orders, current, middle)
    k3 = derivative(hull, state + 0.5 * step_s * k2, orders, current, middle)
    k4 = derivative(hull, state + step_s * k3, orders, current, end)
    return np.asarray(state + step_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))


def derivative(hull: Hull, state: Array, orders: Orders, current: Current, weather: Force) -> Array:
    """Return the time derivative of a state (row, run)."""
    _, _, roll, heading, u, v, p, r, azimuth, rpm = state
    u_current, v_current = current.in_body_axes(heading)
    motion = Motion(u - u_current, v - v_current, p, r)
    force = _hull_force(hull, motion, roll) + weather
    for thruster in hull.thrusters:
        force += _thruster_force(thruster, motion, azimuth, hull.thrust_by_rpm2 * rpm**2)
    du, dv, dp, dr = _acceleration(hull, force)
    cos, sin = np.cos(heading), np.sin(heading)
    return np.stack(
        [
            u * cos - v * sin,
            u * sin + v * cos,
            p,
            r,
            du + r * v_current,
            dv - r * u_current,
            dp,
            dr,
            _approach(azimuth, orders.azimuth, hull.azimuth_lag, hull.azimuth_rate),
            _approach(rpm, orders.rpm, hull.rpm_lag, hull.rpm_rate),
        ]
    )


def _approach(value: Array, order: Array, lag_s: float, rate: float) -> Array:
    return np.clip((order - value) / lag_s, -rate, rate)


def _acceleration(hull: Hull, force: Force) -> tuple[Array, Array, Array, Array]:
    """Solve ``M a = F``: roll and yaw couple with sway but not with each other."""
    sway_roll = -hull.sway_added_mass * hull.added_mass_z
    sway_yaw = hull.added_mass_x * hull.sway_added_mass
    by_roll, by_yaw = sway_roll / hull.roll_inertia, sway_yaw / hull.yaw_inertia
    sway_mass = hull.mass + hull.sway_added_mass - by_roll * sway_roll - by_yaw * sway_yaw
    dv = (force.sway - by_roll * force.roll - by_yaw * force.yaw) / sway_mass
    return (
        force.surge / (hull.mass + hull.surge_added_mass),
        dv,
        (force.roll - sway_roll * dv) / hull.roll_inertia,
        (force.yaw - sway_yaw * dv) / hull.yaw_inertia,
    )


def _hull_force(hull: Hull, motion: Motion, roll: Array) -> Force:
    return (
        _coriolis(hull, motion)
        + _resistance_and_damping(hull, motion, roll)
        + _cross_flow(hull, motion)
    )


def _coriolis(hull: Hull, motion: Motion) -> Force:
    """Coriolis and centripetal terms; the yaw moment holds the Munk moment already."""
    u, v, _, r = motion
    a11, a22, xa = hull.surge_added_mass, hull.sway_added_mass, hull.added_mass_x
    return Force(
        surge=(hull.mass + a22) * v * r + xa * a22 * r**2,
        sway=-(hull.mass + a11) * u * r,
        roll=a11 * hull.added_mass_z * u * r,
        yaw=-(a22 - a11) * u * v - xa * a22 * u * r,
    )


def _resistance_and_damping(hull: Hull, motion: Motion, roll: Array) -> Force:
    u, v, p, r = motion
    coefficient = hull.resistance + hull.resistance_by_drift * np.abs(np.arctan2(v, u))
    d22, depth = hull.sway_damping, hull.drag_depth
    return Force(
        surge=-0.5 * WATER_DENSITY * hull.draught * hull.beam * coefficient * u * np.abs(u),
        sway=-d22 * v - depth * d22 * p,
        roll=-depth * d22 * v - hull.roll_damping * p - hull.roll_stiffness * roll,
        yaw=np.zeros_like(r),
    )


def _cross_flow(hull: Hull, motion: Motion) -> Force:
    """Cross-flow drag at points along the keel, both ends included."""
    x = np.linspace(-0.5, 0.5, _CROSS_FLOW_POINTS)[:, None] * hull.length
    spacing = hull.length / (_CROSS_FLOW_POINTS - 1)
    across = motion.v + hull.drag_depth * motion.p + x * motion.r
    drag = np.abs(across) * across
    scale = 0.5 * WATER_DENSITY * hull.cross_flow_drag * hull.draught * spacing
    sway = -scale * ordered_sum(drag)
    return Force(
        surge=np.zeros_like(motion.u),
        sway=sway,
        roll=hull.drag_depth * sway,
        yaw=-scale * ordered_sum(x * drag),
    )


def _thruster_force(thruster: Thruster, motion: Motion, azimuth: Array, thrust: Array) -> Force:
    """Thrust along the azimuth angle, and lift and drag of the housing in the local flow."""
    angle = thruster.steering * azimuth
    u = motion.u - thruster.y * motion.r
    v = motion.v + thruster.x * motion.r
    inflow = np.arctan2(v, u)
    attack = wrap(angle - inflow)
    pressure_area = 0.5 * _FOIL_WATER_DENSITY * thruster.foil_area * (u**2 + v**2)
    drag = pressure_area * (0.3 + 0.3 * np.abs(attack))
    lift = pressure_area * 0.5 * np.sin(2.0 * attack)
    cos, sin = np.cos(inflow), np.sin(inflow)
    surge = thrust * np.cos(angle) - drag * cos - lift * sin
    sway = thrust * np.sin(angle) - drag * sin + lift * cos
    return Force(
        surge=surge,
        sway=sway,
        roll=-thruster.z * sway,
        yaw=thruster.x * sway - thruster.y * surge,
    )
