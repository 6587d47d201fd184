"""The three published disturbance cases, as levels of wind, waves and current over time.

Source: E. Isaku et al., "Out of Distribution Detection in Self-adaptive Robots with AI-powered
Digital Twins", 2025, section "Maneuvers and Disturbance Scenarios": disturbances come and go
between minutes 7 and 14, speeds change by 35-40 kn/min and directions by 90 deg/min.

A strength ``s`` sets each level to ``edge + s (full - edge)``: ``edge`` is the upper end of normal
light weather, so that even a weak event lies outside of what is normal.
"""

from dataclasses import dataclass

import numpy as np

from odisar.config.simulators import EnvironmentConfig, LevelRange
from odisar.recordings.schema import UNDISTURBED
from odisar.simulators.vessel.fleet import ALL_COMPONENTS, RunPlan
from odisar.simulators.vessel.hull import KNOT_M_S, Array
from odisar.simulators.vessel.voyage import Voyage

#: What each case disturbs. Case 2 strengthens wind and current; its waves stay light.
_DISTURBED_BY_CASE = {
    "case-1": ("wind", "waves", "current"),
    "case-2": ("wind", "current"),
    "case-3": ("wind", "waves", "current"),
}
#: Only case 2 has weather before its event: light wind and waves.
_LIGHT_BY_CASE = {"case-1": (), "case-2": ("wind", "waves"), "case-3": ()}
_GUSTS_REMAIN_AFTER = "case-1"


@dataclass(frozen=True)
class Weather:
    """Weather of one run over time, each (step,), or of several, each (step, run).

    ``wind``, ``gust_wind`` (the mean wind speed whose gusts blow) and ``current`` are in m/s,
    ``waves`` is the significant height in m; directions in rad are where they come from.
    """

    wind: Array
    gust_wind: Array
    wind_from: Array
    waves: Array
    waves_from: Array
    current: Array
    current_from: Array


@dataclass(frozen=True)
class _Change:
    """A level or direction: what it is around the event and in it, and how fast it changes."""

    around: float
    inside: float
    rate_per_s: float


def weather_of(
    plan: RunPlan, voyage: Voyage, environment: EnvironmentConfig, time_s: Array
) -> Weather:
    """Return the weather of one run at ``time_s`` (step,) seconds from the first sample."""
    light, knots_per_s = voyage.light, voyage.speed_rate_kn_min / 60.0
    metres_per_s = environment.wave_rate_m_min / 60.0
    wind = _level(plan, "wind", light.wind_kn, environment.wind_kn, knots_per_s)
    waves = _level(plan, "waves", light.waves_m, environment.waves_m, metres_per_s)
    current = _level(plan, "current", light.current_kn, environment.current_kn, knots_per_s)
    event = (voyage.onset_s, voyage.end_s)
    # An end long after the last sample: the gusts never begin to go.
    gusts_end = time_s[-1] + 600.0 if plan.disturbance == _GUSTS_REMAIN_AFTER else voyage.end_s
    turn = environment.direction_rate_deg_min / 60.0
    return Weather(
        wind=KNOT_M_S * _over_time(wind, time_s, event),
        gust_wind=KNOT_M_S * _over_time(wind, time_s, (voyage.onset_s, gusts_end)),
        wind_from=_turning(
            _direction(plan, "wind", light.wind_from_deg, environment.wind_from_deg, turn),
            time_s,
            event,
        ),
        waves=_over_time(waves, time_s, event),
        waves_from=_turning(
            _direction(plan, "waves", light.waves_from_deg, environment.waves_from_deg, turn),
            time_s,
            event,
        ),
        current=KNOT_M_S * _over_time(current, time_s, event),
        current_from=_turning(
            _direction(plan, "current", light.current_from_deg, environment.current_from_deg, turn),
            time_s,
            event,
        ),
    )


def is_disturbed(plan: RunPlan, component: str) -> bool:
    """Whether the event of a run changes this component of the weather."""
    if plan.disturbance == UNDISTURBED:
        return False
    if plan.components != ALL_COMPONENTS:
        return component == plan.components
    return component in _DISTURBED_BY_CASE[plan.disturbance]


def _level(
    plan: RunPlan, component: str, light: float, levels: LevelRange, rate_per_s: float
) -> _Change:
    has_light = (
        plan.light
        if plan.disturbance == UNDISTURBED
        else component in _LIGHT_BY_CASE[plan.disturbance]
    )
    around = light if has_light else 0.0
    if not is_disturbed(plan, component):
        return _Change(around, around, rate_per_s)
    strength = 0.0 if plan.strength is None else plan.strength
    return _Change(around, levels.edge + strength * (levels.full - levels.edge), rate_per_s)


def _direction(
    plan: RunPlan, component: str, light_deg: float, event_deg: float, rate_per_s: float
) -> _Change:
    """Turn from the light weather's direction to the event's, the shorter way round [deg]."""
    if not is_disturbed(plan, component):
        return _Change(light_deg, light_deg, rate_per_s)
    shorter_way = (event_deg - light_deg + 180.0) % 360.0 - 180.0
    return _Change(light_deg, light_deg + shorter_way, rate_per_s)


def _over_time(change: _Change, time_s: Array, event: tuple[float, float]) -> Array:
    """Return the level (step,): it leaves ``around`` at the onset and is back at the end."""
    share = _share_of_change(change, time_s, event)
    # Smooth at both ends and of the stated mean rate.
    return change.around + (change.inside - change.around) * share**2 * (3.0 - 2.0 * share)


def _turning(change: _Change, time_s: Array, event: tuple[float, float]) -> Array:
    """Return the direction [rad] (step,), turning at a constant rate."""
    share = _share_of_change(change, time_s, event)
    return np.deg2rad(change.around + (change.inside - change.around) * share)


def _share_of_change(change: _Change, time_s: Array, event: tuple[float, float]) -> Array:
    onset_s, end_s = event
    # Never longer than half the event, so that it has begun to go only after it has come.
    transition_s = min(
        max(abs(change.inside - change.around) / change.rate_per_s, 1e-9), 0.5 * (end_s - onset_s)
    )
    coming = np.clip((time_s - onset_s) / transition_s, 0.0, 1.0)
    going = np.clip((time_s - (end_s - transition_s)) / transition_s, 0.0, 1.0)
    return np.asarray(coming - going)
