import json

import numpy as np
import pytest
from scipy import stats

from odisar.capability.distribution import GaussianForecast, NoiseFloor
from odisar.capability.recalibration import (
    LevelMap,
    RecalibratedForecast,
    Recalibration,
    fit_recalibration,
    predictive_distributions,
)
from odisar.errors import OdisarError


def cases(windows=400, steps=5, seed=0, *, promised=0.5, bias=0.0):
    """Return a normal forecast with so much of the true spread, of two states, and truths."""
    rng = np.random.default_rng(seed)
    std = rng.uniform(0.5, 2.0, size=(windows, steps, 2))
    mean = rng.normal(size=std.shape)
    truth = mean + std * (rng.normal(size=std.shape) + bias)
    return GaussianForecast(mean, (promised * std) ** 2), truth


def inside(forecast, truth, coverage):
    low, high = forecast.interval(coverage)
    return float(np.mean((truth >= low) & (truth <= high)))


def test_an_overconfident_forecast_is_repaired_on_recordings_it_was_not_fitted_on():
    forecast, truth = cases(seed=1)
    recalibration = fit_recalibration([forecast.levels(truth)])
    fresh, fresh_truth = cases(seed=2)
    repaired = RecalibratedForecast(fresh, recalibration)
    for coverage in (0.5, 0.8, 0.9, 0.95):
        # Both sides are samples of 4000 cases; four of their joint standard errors.
        tolerance = 4 * np.sqrt(2 * coverage * (1 - coverage) / fresh_truth.size)
        assert inside(repaired, fresh_truth, coverage) == pytest.approx(coverage, abs=tolerance)
        promised = np.abs(2 * fresh.levels(fresh_truth) - 1) <= coverage
        assert promised.mean() < coverage - 0.15
    np.testing.assert_allclose(repaired.std.mean(), 2 * fresh.std.mean(), rtol=0.03)
    assert repaired.crps(fresh_truth).mean() < fresh.crps(fresh_truth).mean()


def test_a_bias_is_taken_out_in_its_own_direction():
    forecast, truth = cases(seed=3, promised=1.0, bias=1.5)
    recalibration = fit_recalibration([forecast.levels(truth)])
    fresh, fresh_truth = cases(seed=4, promised=1.0, bias=1.5)
    repaired = RecalibratedForecast(fresh, recalibration)
    for level in (0.1, 0.5, 0.9):
        assert np.mean(fresh_truth <= repaired.quantiles(level)) == pytest.approx(level, abs=0.03)
    shift = (repaired.quantiles(0.5) - fresh.mean) / fresh.std
    np.testing.assert_allclose(shift, 1.5, atol=0.1)


def test_a_well_specified_forecast_stays_about_as_it_is():
    forecast, truth = cases(2000, seed=5, promised=1.0)
    repaired = RecalibratedForecast(forecast, fit_recalibration([forecast.levels(truth)]))
    levels = forecast.levels(truth)
    np.testing.assert_allclose(repaired.levels(truth), levels, atol=0.02)
    np.testing.assert_allclose(repaired.std, forecast.std, rtol=0.03)


def test_recalibration_never_reorders_and_quantiles_invert_it():
    forecast, truth = cases(100, seed=6, promised=0.1, bias=-1.0)
    recalibration = fit_recalibration([forecast.levels(truth)])
    levels = np.linspace(0, 1, 2001)
    for _, _, level_map in recalibration.cells():
        frequencies = level_map.frequencies(levels)
        assert (np.diff(frequencies) >= 0).all()
        assert (frequencies[0], frequencies[-1]) == (0, 1)
    repaired = RecalibratedForecast(forecast, recalibration)
    last = np.full(truth.shape, -np.inf)
    for level in (0.001, 0.025, 0.3, 0.5, 0.77, 0.975, 0.999):
        quantiles = repaired.quantiles(level)
        assert np.isfinite(quantiles).all()
        assert (quantiles > last).all()
        # Close to the ends a level in double precision is coarse.
        np.testing.assert_allclose(repaired.levels(quantiles), level, atol=1e-4)
        last = quantiles


def test_the_map_agrees_with_isotonic_recalibration_of_the_uncertainty_toolbox():
    toolbox = pytest.importorskip("uncertainty_toolbox")
    forecast, truth = cases(4000, seed=7, promised=0.6, bias=0.4)
    recalibration = fit_recalibration([forecast.levels(truth)])
    asked = np.linspace(0.02, 0.98, 49)
    for _, state, level_map in recalibration.cells():
        # Forecast and truth change places: the toolbox counts forecast - truth, so what it calls
        # the share below a quantile is the share above the mirrored one.
        expected, observed = toolbox.get_proportion_lists_vectorized(
            truth[..., state].ravel(),
            forecast.std[..., state].ravel(),
            forecast.mean[..., state].ravel(),
            num_bins=1000,
            prop_type="quantile",
        )
        published = toolbox.recalibration.iso_recal(expected, observed)
        # Its map leads from observed to expected, which is our inverse.
        np.testing.assert_allclose(level_map.levels(asked), published.predict(asked), atol=4e-3)
        quantiles = RecalibratedForecast(forecast, recalibration).quantiles(0.9)
        theirs = toolbox.metrics_calibration.get_quantile(
            forecast.mean[..., state].ravel(),
            forecast.std[..., state].ravel(),
            0.9,
            recal_model=published,
        )
        np.testing.assert_allclose(quantiles[..., state].ravel(), theirs, atol=0.05)


def test_knots_are_the_observed_frequencies():
    levels = np.linspace(0.2, 0.6, 99).reshape(33, 3, 1)
    level_map = fit_recalibration([levels[:10], levels[10:]]).maps[0][0]
    np.testing.assert_allclose(level_map.frequencies(levels.ravel()), np.arange(1, 100) / 100)
    assert level_map.frequencies(np.array([0.1]))[0] == pytest.approx(0.005)


def test_groups_of_steps_and_states_are_mapped_apart():
    rng = np.random.default_rng(8)
    levels = rng.uniform(size=(200, 5, 2))
    levels[:, :3, 0] **= 4
    levels[:, 3:, 1] = 0.5 + 0.01 * levels[:, 3:, 1]
    recalibration = fit_recalibration([levels], step_groups=2)
    cells = [(steps.start, steps.stop, state) for steps, state, _ in recalibration.cells()]
    assert cells == [(0, 3, 0), (0, 3, 1), (3, 5, 0), (3, 5, 1)]
    mapped = recalibration.frequencies(levels)
    for part in (slice(3), slice(3, 5)):
        for state in range(2):
            uniform = stats.kstest(mapped[:, part, state].ravel(), "uniform").statistic
            assert uniform < 0.02
    together = fit_recalibration([levels]).frequencies(levels)
    assert stats.kstest(together[:, :3, 0].ravel(), "uniform").statistic > 0.1


def test_unknown_levels_have_no_part_and_stay_unknown():
    rng = np.random.default_rng(9)
    levels = rng.uniform(size=(60, 4, 1))
    with_gaps = np.concatenate([levels, np.full((30, 4, 1), np.nan)])
    plain, gappy = fit_recalibration([levels]), fit_recalibration([with_gaps])
    np.testing.assert_array_equal(plain.maps[0][0].predicted, gappy.maps[0][0].predicted)
    mapped = gappy.frequencies(with_gaps)
    assert np.isnan(mapped[60:]).all()
    assert np.isfinite(mapped[:60]).all()


def test_a_spread_that_is_far_too_small_still_gives_finite_intervals():
    forecast, truth = cases(100, seed=10, promised=0.001)
    repaired = RecalibratedForecast(forecast, fit_recalibration([forecast.levels(truth)]))
    low, high = repaired.interval(0.95)
    assert np.isfinite(low).all()
    assert np.isfinite(high).all()
    assert np.isfinite(repaired.crps(truth)).all()
    # What no level can express isn't mended: 7 of its standard deviations are the limit.
    assert ((high - low) / forecast.std).max() < 16


def test_the_crps_integrates_the_pinball_loss_and_of_a_plain_map_is_the_normals():
    forecast, truth = cases(60, seed=11, promised=0.7, bias=0.3)
    recalibration = fit_recalibration([forecast.levels(truth)])
    repaired = RecalibratedForecast(forecast, recalibration)
    loss = np.zeros(truth.shape)
    midpoints = (np.arange(2000) + 0.5) / 2000
    for level in midpoints:
        below = repaired.quantiles(level) - truth
        loss += 2 * ((below > 0) - level) * below / len(midpoints)
    np.testing.assert_allclose(repaired.crps(truth), loss, rtol=1e-9, atol=1e-12)
    same = LevelMap(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    unchanged = RecalibratedForecast(forecast, Recalibration(((same, same),), 5, 60))
    np.testing.assert_allclose(unchanged.crps(truth), forecast.crps(truth), rtol=2e-3, atol=2e-4)
    np.testing.assert_allclose(unchanged.std, forecast.std, rtol=1e-3)


def test_a_nearly_certain_forecast_has_its_absolute_error_as_crps():
    _, truth = cases(30)
    certain = GaussianForecast(np.zeros(truth.shape), np.full(truth.shape, 1e-18))
    levels = np.random.default_rng(0).uniform(size=truth.shape)
    repaired = RecalibratedForecast(certain, fit_recalibration([levels]))
    np.testing.assert_allclose(repaired.crps(truth), np.abs(truth), rtol=1e-6, atol=1e-8)


def test_the_three_distributions_come_from_the_same_draws():
    rng = np.random.default_rng(12)
    draws = rng.normal(size=(6, 30, 4, 2))
    noise = NoiseFloor(np.full((4, 2), 0.5), 30)
    recalibration = fit_recalibration([rng.uniform(size=(30, 4, 2))])
    found = predictive_distributions(draws, noise, recalibration)
    assert list(found) == ["draws", "draws-plus-noise", "recalibrated"]
    np.testing.assert_allclose(found["draws"].std, draws.std(axis=0))
    np.testing.assert_allclose(found["draws-plus-noise"].std, np.sqrt(draws.var(axis=0) + 0.5))
    np.testing.assert_array_equal(found["recalibrated"].base.mean, draws.mean(axis=0))


def test_a_recalibration_comes_back_from_json():
    forecast, truth = cases(30)
    recalibration = fit_recalibration([forecast.levels(truth)], step_groups=2)
    back = Recalibration.from_json(json.loads(json.dumps(recalibration.as_json())))
    levels = np.random.default_rng(0).uniform(size=truth.shape)
    np.testing.assert_array_equal(back.frequencies(levels), recalibration.frequencies(levels))
    assert (back.windows, back.horizon_steps) == (30, 5)


RISING = {"predicted": [0.0, 0.4, 1.0], "observed": [0.0, 0.5, 1.0]}


@pytest.mark.parametrize(
    ("maps", "reason"),
    [
        ([[{"predicted": [0.0, 1.0]}]], "observed"),
        ([[{**RISING, "observed": [0.0, 1.0, 0.5]}]], "must rise"),
        ([[{**RISING, "predicted": [0.1, 0.4, 1.0]}]], "must rise"),
        ([[{**RISING, "predicted": [0.0, float("nan"), 1.0]}]], "must rise"),
        ([[{**RISING, "observed": [0.0, 1.0]}]], "3 levels for 2 frequencies"),
        ([[RISING], [RISING, RISING]], "same states"),
        ([[RISING]] * 3, "3 step groups doesn't divide 2 steps"),
        ([], "0 step groups"),
        ([[]], "the same states"),
    ],
)
def test_what_is_no_recalibration_is_refused(maps, reason):
    with pytest.raises(OdisarError, match=reason):
        Recalibration.from_json({"maps": maps, "horizon_steps": 2, "windows": 30})


def test_too_few_windows_and_too_many_groups_are_refused():
    with pytest.raises(OdisarError, match="19 windows cannot say"):
        fit_recalibration([np.full((19, 3, 1), 0.5)])
    with pytest.raises(OdisarError, match="0 windows cannot say"):
        fit_recalibration([])
    with pytest.raises(OdisarError, match="4 step groups"):
        fit_recalibration([np.full((20, 3, 1), 0.5)], step_groups=4)
    levels = np.full((30, 3, 1), np.nan)
    levels[0] = 0.5
    with pytest.raises(OdisarError, match="3 known truths"):
        fit_recalibration([levels])


def test_forecasts_of_other_states_are_refused():
    recalibration = fit_recalibration([np.random.default_rng(0).uniform(size=(30, 5, 3))])
    with pytest.raises(OdisarError, match=r"\(5, 3\) doesn't fit forecasts of \(5, 2\)"):
        RecalibratedForecast(cases(30)[0], recalibration)
