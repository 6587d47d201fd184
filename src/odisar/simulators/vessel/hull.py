"""Hulls: what the equations of motion need to know about R/V Gunnerus and about the ferry.

Source: NTNU's public four-degree-of-freedom manoeuvring model of R/V Gunnerus (NTNU-MCS,
MCSim_python) for Gunnerus and for every coefficient that carries over without a dimension.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.config.simulators import FerryConfig

Array = NDArray[np.float64]

WATER_DENSITY = 1025.0
GRAVITY = 9.81
KNOT_M_S = 1852.0 / 3600.0

# Gunnerus' coefficients without a dimension, used for both hulls.
_SURGE_ADDED_MASS = 0.05
_SWAY_ADDED_MASS = 0.4
_RESISTANCE = 0.12
_RESISTANCE_BY_DRIFT = 0.2
#: Linear sway damping over rho L T U: 1e5 kg/s, at the 5.3 m/s that Gunnerus made in its trial.
_LINEAR_SWAY = 1.0e5 / (WATER_DENSITY * 33.9 * 2.786 * 5.3)
#: Height of the added mass above the keel, by draught.
_ADDED_MASS_HEIGHT = 1.56 / 2.786


@dataclass(frozen=True)
class Thruster:
    """An azimuth thruster: position from the centre of gravity [m] and the share of the order.

    ``steering`` multiplies the ordered angle: 1 follows it, -1 mirrors it, 0 is locked ahead.
    ``foil_area`` [m2] is the area of the housing that gives lift and drag.
    """

    x: float
    y: float
    z: float
    foil_area: float
    steering: float


@dataclass(frozen=True)
class Hull:
    """A hull in SI units; fields that vary by loading are (run,) arrays or plain floats.

    Axes: x forward, y to starboard, z up from the centre of gravity; roll is positive with port
    down, so that a force ``Y`` at height ``z`` gives the moment ``K = -z Y``. ``drag_depth`` is how
    far below the centre of gravity the drag of sway acts: at the keel in Gunnerus' model, at half
    the draught for the ferry.
    """

    length: float
    beam: float
    draught: Array | float
    mass: Array | float
    kg: float
    surge_added_mass: Array | float
    sway_added_mass: Array | float
    added_mass_x: float
    added_mass_z: Array | float
    roll_inertia: Array | float
    yaw_inertia: Array | float
    resistance: float
    resistance_by_drift: float
    cross_flow_drag: float
    drag_depth: float
    sway_damping: Array | float
    roll_damping: Array | float
    roll_stiffness: Array | float
    thrusters: tuple[Thruster, ...]
    thrust_by_rpm2: float
    azimuth_rate: float
    azimuth_lag: float
    rpm_rate: float
    rpm_lag: float


def gunnerus() -> Hull:
    """Return R/V Gunnerus: 33.9 x 9.6 m, two azimuth thrusters side by side at the stern."""
    kg = 3.54
    shape = _Shape(
        length=33.9,
        beam=9.6,
        draught=2.786,
        mass=531e3,
        kg=kg,
        gm=1.73,
        roll_radius=3.0,
        yaw_radius=9.0,
        added_mass_x=-3.0,
        cross_flow_drag=1.5,
        drag_depth=kg,
        roll_damping_ratio=0.2,
        speed=5.3,
    )
    thrusters = tuple(Thruster(-33.9 / 2, y, -kg - 1.0, 9.0, 1.0) for y in (-2.7, 2.7))
    return _hull(shape, thrusters, 2.2, np.deg2rad(30.0), 1.0)


def ferry(config: FerryConfig, loading: Array | float = 1.0) -> Hull:
    """Return the ferry with its displacement and draught multiplied by ``loading`` (run,)."""
    draught = config.draught_m * loading
    shape = _Shape(
        length=config.length_m,
        beam=config.beam_m,
        draught=draught,
        mass=WATER_DENSITY * config.length_m * config.beam_m * draught * config.block_coefficient,
        kg=config.kg_m,
        gm=config.gm_m,
        roll_radius=config.roll_gyration * config.beam_m,
        yaw_radius=config.yaw_gyration * config.length_m,
        added_mass_x=0.0,  # a double-ended hull is the same fore and aft
        cross_flow_drag=config.cross_flow_drag,
        drag_depth=config.kg_m - 0.5 * config.draught_m,
        roll_damping_ratio=config.roll_damping_ratio,
        speed=config.service_speed_kn * KNOT_M_S,
    )
    height = -config.kg_m - config.thruster_below_keel_m
    reach = config.thruster_reach * config.length_m
    bow = {"mirrored": -1.0, "locked": 0.0}[config.bow_thruster]
    thrusters = (
        Thruster(reach, 0.0, height, config.foil_forward_m2, bow),
        Thruster(-reach, 0.0, height, config.foil_aft_m2, 1.0),
    )
    rate = np.deg2rad(config.azimuth_rate_deg_s)
    return _hull(shape, thrusters, config.thrust_n_per_rpm2, rate, config.azimuth_lag_s)


@dataclass(frozen=True)
class _Shape:
    """Particulars of a hull, before what follows from them."""

    length: float
    beam: float
    draught: Array | float
    mass: Array | float
    kg: float
    gm: float
    roll_radius: float
    yaw_radius: float
    added_mass_x: float
    cross_flow_drag: float
    drag_depth: float
    roll_damping_ratio: float
    speed: float


def _hull(
    shape: _Shape,
    thrusters: tuple[Thruster, ...],
    thrust_by_rpm2: float,
    azimuth_rate: float,
    azimuth_lag: float,
) -> Hull:
    """Fill in what follows from the particulars, with Gunnerus' coefficients."""
    mass, draught = shape.mass, shape.draught
    sway_added_mass = _SWAY_ADDED_MASS * mass
    added_mass_z = -shape.kg + _ADDED_MASS_HEIGHT * draught
    roll_radius2, yaw_radius2 = shape.roll_radius**2, shape.yaw_radius**2
    roll_inertia = mass * roll_radius2 + sway_added_mass * (roll_radius2 + added_mass_z**2)
    roll_stiffness = mass * GRAVITY * shape.gm
    return Hull(
        length=shape.length,
        beam=shape.beam,
        draught=draught,
        mass=mass,
        kg=shape.kg,
        surge_added_mass=_SURGE_ADDED_MASS * mass,
        sway_added_mass=sway_added_mass,
        added_mass_x=shape.added_mass_x,
        added_mass_z=added_mass_z,
        roll_inertia=roll_inertia,
        yaw_inertia=mass * yaw_radius2 + sway_added_mass * (yaw_radius2 + shape.added_mass_x**2),
        resistance=_RESISTANCE,
        resistance_by_drift=_RESISTANCE_BY_DRIFT,
        cross_flow_drag=shape.cross_flow_drag,
        drag_depth=shape.drag_depth,
        sway_damping=_LINEAR_SWAY * WATER_DENSITY * shape.length * draught * shape.speed,
        roll_damping=2.0 * shape.roll_damping_ratio * np.sqrt(roll_stiffness * roll_inertia),
        roll_stiffness=roll_stiffness,
        thrusters=thrusters,
        thrust_by_rpm2=thrust_by_rpm2,
        azimuth_rate=azimuth_rate,
        azimuth_lag=azimuth_lag,
        rpm_rate=30.0,
        rpm_lag=1.0,
    )
