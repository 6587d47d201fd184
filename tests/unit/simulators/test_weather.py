"""Gusts and waves have the strength that was asked for, and meet the ship as they should."""

import numpy as np
import pytest

from odisar.simulators.vessel.dynamics import Motion
from odisar.simulators.vessel.hull import GRAVITY, ferry
from odisar.simulators.vessel.waves import Sea, draw_sea
from odisar.simulators.vessel.wind import Gusts, draw_gust_phases, wind_force

RUNS = 40


def test_gusts_have_davenports_intensity(vessel):
    config = vessel.environment.gusts
    stream = np.random.default_rng(0)
    gusts = Gusts(config, np.stack([draw_gust_phases(config, stream) for _ in range(RUNS)], -1))
    wind = np.full(RUNS, 10.0)
    along, across = [], []
    for _ in range(3000):
        u, v = gusts.speeds(wind)
        gusts.advance(wind, 0.5)
        along.append(u)
        across.append(v)
    # sigma^2 = 6 k U^2, less what lies outside of the band of harmonics.
    expected = np.sqrt(6.0 * config.surface_drag) * 10.0
    assert np.std(along) == pytest.approx(expected, rel=0.1)
    assert np.std(across) == pytest.approx(config.lateral_share * expected, rel=0.1)


@pytest.fixture
def sea(vessel):
    config = vessel.environment.waves.model_copy(update={"spreading_deg": 0.0})
    stream = np.random.default_rng(1)
    draws = np.stack([draw_sea(config, stream) for _ in range(RUNS)], -1)
    return Sea(config, ferry(vessel.ferry), draws)


def _roll_moments(sea, ship_speed, heading, steps=1200):
    still = np.zeros(RUNS)
    motion = Motion(np.full(RUNS, ship_speed), still, still, still)
    height, waves_from = np.full(RUNS, 2.0), np.zeros(RUNS)
    return np.array(
        [
            sea.forces(motion, np.full(RUNS, heading), height, waves_from, 0.5)[0].sway
            for _ in range(steps)
        ]
    )


def _mean_period_s(signal):
    centred = signal[:, 0] - signal[:, 0].mean()
    crossings = np.count_nonzero((centred[:-1] < 0) & (centred[1:] >= 0))
    return 0.5 * len(centred) / crossings


def test_a_beam_sea_meets_a_ship_at_its_own_period(vessel, sea):
    period = _mean_period_s(_roll_moments(sea, 0.0, np.pi / 2))
    peak = vessel.environment.waves.peak_period_s_per_sqrt_m * np.sqrt(2.0)
    assert 0.6 * peak < period < 1.1 * peak


def test_a_ship_meets_bow_seas_more_often_than_quartering_seas(sea):
    bow = _mean_period_s(_roll_moments(sea, 7.0, np.deg2rad(60)))
    quarter = _mean_period_s(_roll_moments(sea, 7.0, np.deg2rad(120)))
    assert bow < 0.8 * quarter


def test_a_beam_sea_drifts_the_ship_to_leeward_with_the_square_of_its_height(vessel):
    config = vessel.environment.waves
    stream = np.random.default_rng(2)
    draws = np.stack([draw_sea(config, stream) for _ in range(RUNS)], -1)
    still = np.zeros(RUNS)
    means = []
    for height in (1.0, 2.0):
        waves = Sea(config, ferry(vessel.ferry), draws)
        forces = [
            waves.forces(
                Motion(still, still, still, still),
                still,
                np.full(RUNS, height),
                np.full(RUNS, np.pi / 2),
                0.5,
            )[0].sway
            for _ in range(1200)
        ]
        means.append(np.mean(forces))
    # Waves from starboard push to port.
    expected = 0.5 * 1025.0 * GRAVITY * config.lateral_drift * vessel.ferry.length_m / 8.0
    assert means[0] == pytest.approx(-expected, rel=0.2)
    assert means[1] / means[0] == pytest.approx(4.0, rel=0.2)


def test_no_waves_no_force(sea):
    still = np.zeros(RUNS)
    first, _, _ = sea.forces(Motion(still, still, still, still), still, still, still, 0.5)
    assert not np.any(first.sway)
    assert not np.any(first.roll)
    assert not np.any(first.yaw)


@pytest.mark.parametrize(("wind_from_deg", "sign"), [(90.0, -1.0), (270.0, 1.0)])
def test_wind_pushes_and_heels_a_ship_to_leeward(vessel, wind_from_deg, sign):
    windage, state = vessel.ferry.windage, np.zeros((10, 1))
    force = wind_force(
        windage, 109.0, state, np.array([9.26]), np.deg2rad([wind_from_deg]), np.zeros(1)
    )
    assert np.sign(force.sway[0]) == sign
    # Roll is positive with port down: a push to port heels to port.
    assert np.sign(force.roll[0]) == -sign
    # 18 kn on 1,480 m2: about 70 kN.
    assert 50e3 < abs(force.sway[0]) < 100e3
