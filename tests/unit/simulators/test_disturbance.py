"""The three cases: when weather comes, how strong it is, and what remains of it."""

from dataclasses import replace

import numpy as np
import pytest

from odisar.simulators.vessel.disturbance import weather_of
from odisar.simulators.vessel.fleet import RunPlan
from odisar.simulators.vessel.hull import KNOT_M_S
from odisar.simulators.vessel.voyage import draw_voyage

TIME_S = np.arange(-180.0, 1200.0, 0.5)


def _plan(case, strength=1.0, components="all"):
    name = f"test-zigzag-10-{case}"
    return RunPlan(name, name, "test", "zigzag", "10", case, components, strength)


def _weather(vessel, plan):
    voyage = draw_voyage(plan, vessel, 5)
    weather = weather_of(plan, voyage, vessel.environment, TIME_S)
    before, after = voyage.onset_s >= TIME_S, voyage.end_s <= TIME_S
    middle = (voyage.onset_s + 150 <= TIME_S) & (voyage.end_s - 150 >= TIME_S)
    return weather, before, middle, after


@pytest.mark.parametrize("strength", [0.0, 0.1, 0.25, 0.5, 1.0])
def test_a_level_lies_between_the_edge_of_normal_and_the_full_disturbance(vessel, strength):
    environment = vessel.environment
    weather, _, middle, _ = _weather(vessel, _plan("case-3", strength))
    for level, limits, unit in (
        (weather.wind, environment.wind_kn, KNOT_M_S),
        (weather.waves, environment.waves_m, 1.0),
        (weather.current, environment.current_kn, KNOT_M_S),
    ):
        expected = limits.edge + strength * (limits.full - limits.edge)
        np.testing.assert_allclose(level[middle], unit * expected, rtol=1e-12)


def test_case_3_is_calm_around_its_event(vessel):
    weather, before, _, after = _weather(vessel, _plan("case-3"))
    for level in (weather.wind, weather.gust_wind, weather.waves, weather.current):
        np.testing.assert_allclose(level[before | after], 0.0, atol=1e-12)


def test_case_1_keeps_its_gusts_and_nothing_else(vessel):
    weather, before, middle, after = _weather(vessel, _plan("case-1"))
    for level in (weather.wind, weather.waves, weather.current):
        np.testing.assert_allclose(level[before | after], 0.0, atol=1e-12)
    np.testing.assert_allclose(weather.gust_wind[after], weather.gust_wind[middle][0])


def test_case_2_begins_and_ends_in_light_wind_and_waves_and_strengthens_wind_and_current(vessel):
    weather, before, middle, after = _weather(vessel, _plan("case-2"))
    environment = vessel.environment
    light = weather.wind[before][0] / KNOT_M_S
    assert environment.wind_kn.low <= light <= environment.wind_kn.edge
    np.testing.assert_allclose(weather.wind[after], light * KNOT_M_S)
    assert weather.wind[middle].min() > environment.wind_kn.edge * KNOT_M_S
    assert np.ptp(weather.waves) == pytest.approx(0.0)
    assert weather.current[before].max() == pytest.approx(0.0)
    assert weather.current[middle].min() == pytest.approx(environment.current_kn.full * KNOT_M_S)


@pytest.mark.parametrize("component", ["wind", "waves", "current"])
def test_one_component_leaves_the_others_as_they_were(vessel, component):
    weather, _, middle, _ = _weather(vessel, _plan("case-3", components=component))
    for name in ("wind", "waves", "current"):
        raised = getattr(weather, name)[middle].min() > 0.0
        assert raised == (name == component)


def test_wind_rises_and_turns_at_the_published_rates(vessel):
    plan = _plan("case-3")
    voyage = draw_voyage(plan, vessel, 5)
    weather = weather_of(plan, voyage, vessel.environment, TIME_S)
    full = vessel.environment.wind_kn.full
    rising_s = (
        np.count_nonzero(
            (weather.wind > 1e-9)
            & (weather.wind < full * KNOT_M_S * (1 - 1e-9))
            & (voyage.onset_s + 100 > TIME_S)
        )
        * 0.5
    )
    assert 35.0 <= full / (rising_s / 60.0) <= 41.5
    turning = np.abs(np.diff(np.rad2deg(weather.wind_from))) / 0.5 * 60.0
    assert turning.max() == pytest.approx(vessel.environment.direction_rate_deg_min, rel=1e-6)


def test_calm_and_light_clean_runs(vessel):
    plan = RunPlan("train-zigzag-10-1", "train-zigzag-10-1", "train", "zigzag", "10")
    for light in (False, True):
        chosen = replace(plan, light=light)
        voyage = draw_voyage(chosen, vessel, 5)
        weather = weather_of(chosen, voyage, vessel.environment, TIME_S)
        for level, limits, unit in (
            (weather.wind, vessel.environment.wind_kn, KNOT_M_S),
            (weather.waves, vessel.environment.waves_m, 1.0),
            (weather.current, vessel.environment.current_kn, KNOT_M_S),
        ):
            assert np.ptp(level) == 0.0
            assert limits.low * unit <= level[0] <= limits.edge * unit if light else level[0] == 0.0
