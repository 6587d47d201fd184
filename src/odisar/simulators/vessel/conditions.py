"""Wind, waves and current of all runs, step by step."""

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from odisar.config.simulators import VesselSimulatorConfig
from odisar.simulators.vessel.disturbance import Weather, weather_of
from odisar.simulators.vessel.dynamics import Current, Force, Motion
from odisar.simulators.vessel.fleet import RunPlan
from odisar.simulators.vessel.hull import Array, Hull
from odisar.simulators.vessel.voyage import Voyage, run_stream
from odisar.simulators.vessel.waves import Sea, draw_sea
from odisar.simulators.vessel.wind import Gusts, draw_gust_phases, wind_force


class Conditions:
    """What the weather does to every run; call ``forces`` once a step, in order.

    Gusts and waves carry phases from step to step, so that they stay continuous while the weather
    changes.
    """

    def __init__(
        self,
        plans: Sequence[RunPlan],
        voyages: Sequence[Voyage],
        config: VesselSimulatorConfig,
        hull: Hull,
        time_s: Array,
        base_seed: int,
    ) -> None:
        environment = config.environment
        runs = [
            weather_of(plan, voyage, environment, time_s)
            for plan, voyage in zip(plans, voyages, strict=True)
        ]
        self._weather = Weather(
            **{
                field.name: np.stack([getattr(run, field.name) for run in runs], axis=-1)
                for field in fields(Weather)
            }
        )
        gusts = [
            draw_gust_phases(environment.gusts, run_stream(base_seed, plan, "gusts"))
            for plan in plans
        ]
        seas = [draw_sea(environment.waves, run_stream(base_seed, plan, "waves")) for plan in plans]
        self._gusts = Gusts(environment.gusts, np.stack(gusts, axis=-1))
        self._sea = Sea(environment.waves, hull, np.stack(seas, axis=-1))
        self._windage = config.ferry.windage
        self._length = hull.length
        self._step_s = config.step_s

    def current(self, step: int) -> Current:
        """Return the velocity of the water in a step."""
        speed, coming_from = self._weather.current[step], self._weather.current_from[step]
        return Current(-speed * np.cos(coming_from), -speed * np.sin(coming_from))

    def forces(self, state: Array, current: Current, step: int) -> tuple[Force, Force, Force]:
        """Return the force of wind and waves at the beginning, middle and end of a step."""
        heading = state[3]
        along, across = current.in_body_axes(heading)
        motion = Motion(state[4] - along, state[5] - across, state[6], state[7])
        weather = self._weather
        waves = self._sea.forces(
            motion, heading, weather.waves[step], weather.waves_from[step], self._step_s
        )
        wind = self._wind_force(state, step)
        return waves[0] + wind, waves[1] + wind, waves[2] + wind

    def _wind_force(self, state: Array, step: int) -> Force:
        weather = self._weather
        gust_wind = weather.gust_wind[step]
        along, across = self._gusts.speeds(gust_wind)
        self._gusts.advance(gust_wind, self._step_s)
        return wind_force(
            self._windage,
            self._length,
            state,
            weather.wind[step] + along,
            weather.wind_from[step],
            across,
        )
