"""Disturbances of the odometry: what is logged differs from what the wheels counted.

Published is zero-mean Gaussian noise on position, orientation and velocity (E. Isaku et al., "Out
of Distribution Detection in Self-adaptive Robots with AI-powered Digital Twins", 2025). Noise on
the orientation is noise on the yaw: the quaternion stays of unit length.
"""

import numpy as np
from numpy.typing import NDArray

from odisar.config.robot import DisturbanceUnit, RobotDisturbances
from odisar.simulators.robot.grid import Array
from odisar.simulators.robot.odometry import POSE_AND_TWIST

_VELOCITIES = {3: "linear_velocity_x", 4: "linear_velocity_y", 5: "angular_velocity_z"}


def disturb_odometry(
    stream: np.random.Generator,
    kind: str,
    strength: float,
    odometry: Array,
    stamps_s: Array,
    inside: NDArray[np.bool_],
    config: RobotDisturbances,
) -> tuple[Array, str]:
    """Return a copy of odometry (sample, 6) disturbed where ``inside``, and what was done to it.

    Draws don't depend on the strength. Bias and drift are faults of the logged velocity alone:
    the pose doesn't integrate them. Raises KeyError for an unknown kind.
    """
    disturbed = odometry.copy()
    units = _units(config.unit)
    time_s = stamps_s[inside]
    if kind in ("noise", "correlated-noise"):
        draws = stream.standard_normal((len(time_s), len(POSE_AND_TWIST)))
        if kind == "correlated-noise":
            draws = _correlated(draws, time_s, config.correlation_s)
        disturbed[inside] += strength * units * draws
        return disturbed, ""
    column = 3 + int(stream.integers(3))
    sign = 1.0 if stream.random() < 0.5 else -1.0
    size = sign * strength * units[column]
    growth = {
        "bias": np.ones(len(time_s)),
        "drift": (time_s - time_s[0]) / config.duration_s,
    }[kind]
    disturbed[inside, column] += size * growth
    unit = "rad/s" if column == 5 else "m/s"
    return disturbed, f"{_VELOCITIES[column]} {size:+g} {unit}"


def _units(unit: DisturbanceUnit) -> Array:
    position, velocity = unit.position_m, unit.velocity_m_s
    return np.array([position, position, unit.yaw_rad, velocity, velocity, unit.yaw_rate_rad_s])


def _correlated(draws: Array, time_s: Array, correlation_s: float) -> Array:
    """Return a stationary first-order Gauss-Markov process of unit variance from its draws."""
    memory = np.exp(-np.diff(time_s) / correlation_s)
    states = draws.copy()
    for i in range(1, len(draws)):
        fresh = np.sqrt(1.0 - memory[i - 1] ** 2)
        states[i] = memory[i - 1] * states[i - 1] + fresh * draws[i]
    return states
