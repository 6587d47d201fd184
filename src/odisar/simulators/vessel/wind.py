"""Wind: a mean with gusts, and the force it puts on the hull above water."""

import numpy as np

from odisar.config.simulators import GustsConfig, WindageConfig
from odisar.simulators.vessel.dynamics import Force, ordered_sum
from odisar.simulators.vessel.hull import Array

_AIR_DENSITY = 1.225
#: Length of the Davenport spectrum [m]: chi = 1200 f / U.
_GUST_LENGTH_M = 1200.0
_CHI_LOW, _CHI_HIGH = 0.1, 40.0


class Gusts:
    """Gusts along and across the mean wind, as sums of harmonics with seeded phases.

    Davenport's spectrum, ``f S(f) = 4 k U^2 chi^2 / (1 + chi^2)^(4/3)`` with surface drag ``k``
    and ``chi = 1200 f / U``, keeps its shape when the wind changes: amplitudes and frequencies
    both go with U. Source: A. G. Davenport, "The spectrum of horizontal gustiness near the ground
    in high winds", 1961.

    ``phases`` are (2, component, run) in rad: along and across the wind.
    """

    def __init__(self, config: GustsConfig, phases: Array) -> None:
        ends = np.geomspace(_CHI_LOW, _CHI_HIGH, config.components + 1)
        chi = np.sqrt(ends[1:] * ends[:-1])
        variance = 4.0 * config.surface_drag * chi**2 / (1.0 + chi**2) ** (4.0 / 3.0)
        self._amplitudes = np.sqrt(2.0 * variance * np.log(ends[1:] / ends[:-1]))[:, None]
        self._chi = chi[:, None]
        self._lateral_share = config.lateral_share
        self._phases = phases.copy()

    def speeds(self, gust_wind: Array) -> tuple[Array, Array]:
        """Return the gust along and across the wind [m/s] where ``gust_wind`` (run,) blows."""
        along, across = (ordered_sum(self._amplitudes * np.cos(phase)) for phase in self._phases)
        return gust_wind * along, self._lateral_share * gust_wind * across

    def advance(self, gust_wind: Array, step_s: float) -> None:
        """Move the harmonics on by one step."""
        self._phases += 2.0 * np.pi * step_s * self._chi * gust_wind / _GUST_LENGTH_M


def draw_gust_phases(config: GustsConfig, stream: np.random.Generator) -> Array:
    """Return the phases of one run, (2, component) in rad."""
    return 2.0 * np.pi * stream.random((2, config.components))


def wind_force(
    config: WindageConfig, length: float, state: Array, wind: Array, wind_from: Array, across: Array
) -> Force:
    """Return the force of a wind [m/s] from a direction [rad], with a gust across it [m/s].

    Quadratic in the wind relative to the ship; the yaw moment goes with the sine of twice the
    angle, since the centre of pressure moves to windward. Form after O. M. Faltinsen, "Sea Loads
    on Ships and Offshore Structures", 1990, and W. Blendermann, "Parameter identification of wind
    loads on ships", 1994.
    """
    _, _, _, heading, u, v, *_ = state
    angle = wind_from - heading
    cos, sin = np.cos(angle), np.sin(angle)
    ahead = -wind * cos + across * sin - u
    aside = -wind * sin - across * cos - v
    speed = np.sqrt(ahead**2 + aside**2)
    pressure = 0.5 * _AIR_DENSITY
    sway = pressure * config.sway_coefficient * config.lateral_area_m2 * speed * aside
    yaw_area = 2.0 * config.yaw_coefficient * config.lateral_area_m2 * length
    return Force(
        surge=pressure * config.surge_coefficient * config.frontal_area_m2 * speed * ahead,
        sway=sway,
        roll=-config.centre_above_gravity_m * sway,
        yaw=-pressure * yaw_area * ahead * aside,
    )
