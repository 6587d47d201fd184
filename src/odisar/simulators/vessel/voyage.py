"""What varies from run to run: heading, speed, loading, timing and the weather around an event."""

from dataclasses import dataclass

import numpy as np

from odisar.config.simulators import LevelRange, Range, VesselSimulatorConfig
from odisar.seeding import generator
from odisar.simulators.vessel.fleet import RunPlan

#: Which sectors of the compass the runs of a split start in; a split not named uses them all.
_SECTOR_PARITY = {"test": 0, "development": 1}


@dataclass(frozen=True)
class LightWeather:
    """Normal light weather of one run: wind and current [kn], wave height [m], directions [deg].

    Directions are where wind, waves and current come from.
    """

    wind_kn: float
    wind_from_deg: float
    waves_m: float
    waves_from_deg: float
    current_kn: float
    current_from_deg: float


@dataclass(frozen=True)
class Voyage:
    """The draws of one run. Runs that share a seed name share all of them.

    ``maneuver_start_s``, ``onset_s`` and ``end_s`` count from the first sample; ``side`` is the
    sign of the first ordered angle; ``speed_rate_kn_min`` is how fast wind and current change.
    """

    heading_deg: float
    start_speed_m_s: float
    loading: float
    maneuver_start_s: float
    side: float
    onset_s: float
    end_s: float
    speed_rate_kn_min: float
    light: LightWeather


def run_stream(base_seed: int, plan: RunPlan, purpose: str) -> np.random.Generator:
    """Return the random numbers of one run for one purpose, whatever other runs there are."""
    return generator(base_seed, "simulators", "vessel", plan.seed_name, purpose)


def draw_voyage(plan: RunPlan, config: VesselSimulatorConfig, base_seed: int) -> Voyage:
    """Draw what varies in a run. Every run draws the same numbers, used or not."""
    stream = run_stream(base_seed, plan, "voyage")
    maneuvers, event = config.maneuvers, config.event
    jitter = Range(low=-event.jitter_s, high=event.jitter_s)
    return Voyage(
        heading_deg=_draw_heading(stream, plan.split, config.fleet.heading_sector_deg),
        start_speed_m_s=_draw(stream, maneuvers.start_speed_m_s),
        loading=_draw(stream, maneuvers.loading),
        maneuver_start_s=_draw(stream, maneuvers.start_s),
        side=1.0 if stream.random() < 0.5 else -1.0,
        # Whole seconds, so that an interval of labels begins and ends at a sample.
        onset_s=float(round(event.onset_s + _draw(stream, jitter))),
        end_s=float(round(event.end_s + _draw(stream, jitter))),
        speed_rate_kn_min=_draw(stream, config.environment.speed_rate_kn_min),
        light=_draw_light_weather(stream, config),
    )


def _draw_light_weather(stream: np.random.Generator, config: VesselSimulatorConfig) -> LightWeather:
    environment = config.environment
    # Light waves come with the light wind: there's no swell in a fjord.
    wind_from, current_from = (float(x) for x in 360.0 * stream.random(2))
    return LightWeather(
        wind_kn=_draw(stream, _light_range(environment.wind_kn)),
        wind_from_deg=wind_from,
        waves_m=_draw(stream, _light_range(environment.waves_m)),
        waves_from_deg=wind_from,
        current_kn=_draw(stream, _light_range(environment.current_kn)),
        current_from_deg=current_from,
    )


def _light_range(level: LevelRange) -> Range:
    return Range(low=level.low, high=level.edge)


def _draw(stream: np.random.Generator, limits: Range) -> float:
    return limits.low + (limits.high - limits.low) * float(stream.random())


def _draw_heading(stream: np.random.Generator, split: str, sector_deg: float) -> float:
    turn = float(stream.random())
    if split not in _SECTOR_PARITY:
        return 360.0 * turn
    pair, within = divmod(turn * 180.0, sector_deg)
    return (2.0 * pair + _SECTOR_PARITY[split]) * sector_deg + within
