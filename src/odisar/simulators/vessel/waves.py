"""Waves: an irregular, short-crested sea, and the forces it puts on the hull.

Sources: K. Hasselmann et al., JONSWAP, 1973, for the spectrum; Froude-Krylov forces on a box and
drift after O. M. Faltinsen, "Sea Loads on Ships and Offshore Structures", 1990; added resistance
after STAWAVE-1 (ISO 15016:2015).
"""

import numpy as np

from odisar.config.simulators import WavesConfig
from odisar.simulators.vessel.dynamics import Force, Motion, ordered_sum
from odisar.simulators.vessel.hull import GRAVITY, WATER_DENSITY, Array, Hull

#: Frequencies of the components, in peak frequencies; 99 % of the energy of a JONSWAP sea.
_FREQUENCY_LOW, _FREQUENCY_HIGH = 0.65, 2.6
#: Below this height [m] the period stops falling: there's no motion left to excite.
_SMALLEST_HEIGHT_M = 0.05
#: Part of the ferry's length in which the bow's waterline widens (STAWAVE-1).
_BOW_SHARE = 0.2


class Sea:
    """A sea of harmonics with seeded frequencies, directions and phases.

    ``draws`` is (3, component, run): frequency within its band and phase in [0, 1), and a standard
    normal for the direction. The spectrum keeps its shape when the height changes: amplitudes go
    with the height, frequencies with the peak.
    """

    def __init__(self, config: WavesConfig, hull: Hull, draws: Array) -> None:
        ends = np.linspace(_FREQUENCY_LOW, _FREQUENCY_HIGH, config.components + 1)[:, None]
        place, phase, aside = draws
        self._frequencies = ends[:-1] + (ends[1:] - ends[:-1]) * place
        energy = _jonswap_shape(self._frequencies, config.peak_enhancement)
        # Significant height: four standard deviations of the elevation.
        self._amplitudes = 0.25 * np.sqrt(2.0 * energy / ordered_sum(energy))
        self._offsets = np.deg2rad(config.spreading_deg) * aside
        self._phases = 2.0 * np.pi * phase
        self._config = config
        self._hull = hull

    def forces(
        self, motion: Motion, heading: Array, height: Array, waves_from: Array, step_s: float
    ) -> tuple[Force, Force, Force]:
        """Return the force at the beginning, middle and end of a step, and move the sea on.

        ``motion`` is through the water: the ship meets each component at its encounter frequency
        ``omega - k (u cos mu + v sin mu)``, with ``mu`` where it goes to, from ahead.
        """
        peak_s = self._config.peak_period_s_per_sqrt_m * np.sqrt(
            np.maximum(height, _SMALLEST_HEIGHT_M)
        )
        omega = 2.0 * np.pi / peak_s * self._frequencies
        number = omega**2 / GRAVITY
        towards = waves_from + np.pi + self._offsets - heading
        cos, sin = np.cos(towards), np.sin(towards)
        encounter = omega - number * (motion.u * cos + motion.v * sin)
        excitation = self._excitation(number, cos, sin, height)
        drift = self._drift(height, waves_from + np.pi - heading)
        first, middle, last = (
            _harmonic_force(excitation, self._phases + share * step_s * encounter) + drift
            for share in (0.0, 0.5, 1.0)
        )
        self._phases += step_s * encounter
        return first, middle, last

    def _excitation(self, number: Array, cos: Array, sin: Array, height: Array) -> Force:
        """Return the amplitude of each component's force, (component, run) each.

        The pressure gradient of the undisturbed wave over a box, the added mass' share of
        diffraction in sway, roll and yaw, and in roll the hydrostatic moment on the wave slope.
        """
        hull = self._hull
        lengthwise, breadthwise = 0.5 * number * hull.length * cos, 0.5 * number * hull.beam * sin
        depth = -np.expm1(-number * hull.draught) / (number * hull.draught)
        slope = number * self._amplitudes * height * depth * np.sinc(breadthwise / np.pi)
        along_hull = np.sinc(lengthwise / np.pi)
        weight = hull.mass * GRAVITY
        with_diffraction = weight + hull.sway_added_mass * GRAVITY
        beam_slope = slope * sin * along_hull
        # The water carries the added mass along: without its moment, a ship that follows a long
        # wave would be heeled as if it had to push still water aside.
        diffraction_moment = hull.added_mass_z * hull.sway_added_mass * GRAVITY
        return Force(
            surge=-weight * slope * cos * along_hull,
            sway=-with_diffraction * beam_slope,
            roll=(hull.roll_stiffness + diffraction_moment) * beam_slope,
            yaw=with_diffraction * slope * sin * 0.5 * hull.length * _lever(lengthwise),
        )

    def _drift(self, height: Array, towards: Array) -> Force:
        """Mean and slowly varying drift: it goes with the square of the wave envelope."""
        hull, config = self._hull, self._config
        envelope2 = height**2 * (
            ordered_sum(self._amplitudes * np.cos(self._phases)) ** 2
            + ordered_sum(self._amplitudes * np.sin(self._phases)) ** 2
        )
        cos, sin = np.cos(towards), np.sin(towards)
        pressure = 0.5 * WATER_DENSITY * GRAVITY * envelope2
        sway = pressure * config.lateral_drift * hull.length * sin * np.abs(sin)
        # STAWAVE-1: rho g H^2 B sqrt(B / L_bow) / 16; the mean of envelope2 is H^2 / 8.
        blunt = hull.beam * np.sqrt(hull.beam / (_BOW_SHARE * hull.length))
        return Force(
            surge=pressure * blunt * cos * np.abs(cos),
            sway=sway,
            roll=-(hull.draught - hull.kg) * sway,  # at the waterline
            yaw=-pressure * config.yaw_drift_lever * hull.length**2 * sin * cos,
        )


def draw_sea(config: WavesConfig, stream: np.random.Generator) -> Array:
    """Return the draws of one run, (3, component); see ``Sea``."""
    uniform = stream.random((2, config.components))
    return np.vstack([uniform, stream.standard_normal(config.components)])


def _harmonic_force(excitation: Force, phases: Array) -> Force:
    sin, cos = np.sin(phases), np.cos(phases)
    return Force(
        surge=ordered_sum(excitation.surge * sin),
        sway=ordered_sum(excitation.sway * sin),
        roll=ordered_sum(excitation.roll * sin),
        # The two ends are pushed in turn: a quarter of a period after the middle.
        yaw=ordered_sum(excitation.yaw * cos),
    )


def _jonswap_shape(frequencies: Array, peak_enhancement: float) -> Array:
    """Return the JONSWAP spectrum without its scale, at frequencies in peak frequencies."""
    width = np.where(frequencies <= 1.0, 0.07, 0.09)
    peak = np.exp(-0.5 * ((frequencies - 1.0) / width) ** 2)
    return np.asarray(
        frequencies**-5.0 * np.exp(-1.25 * frequencies**-4.0) * peak_enhancement**peak
    )


def _lever(angle: Array) -> Array:
    """Return ``(sin a - a cos a) / a^2``, the lever of a wave along the hull; a/3 near zero."""
    safe = np.where(np.abs(angle) < 1e-3, 1.0, angle)
    return np.where(
        np.abs(angle) < 1e-3, angle / 3.0, (np.sin(safe) - safe * np.cos(safe)) / safe**2
    )
