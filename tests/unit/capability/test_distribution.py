import json

import numpy as np
import pytest

from odisar.capability.distribution import (
    GaussianForecast,
    NoiseFloor,
    disjoint_positions,
    draws_only,
    fit_noise,
    with_noise,
)
from odisar.errors import OdisarError
from odisar.recordings.schema import Recording, RecordingInfo
from odisar.windows.windowing import WindowSpec


def normal_forecast(shape=(40, 5, 3), seed=0):
    rng = np.random.default_rng(seed)
    return GaussianForecast(rng.normal(size=shape), rng.uniform(0.1, 4.0, size=shape))


def test_draws_alone_give_their_mean_and_population_variance():
    draws = np.random.default_rng(0).normal(size=(4, 2, 3, 2)).astype(np.float32)
    forecast = draws_only(draws)
    mean = draws.astype(np.float64).sum(axis=0) / 4
    np.testing.assert_allclose(forecast.mean, mean)
    np.testing.assert_allclose(forecast.variance, ((draws - mean) ** 2).sum(axis=0) / 4)


def test_noise_is_what_the_draws_do_not_explain_of_the_error():
    rng = np.random.default_rng(1)
    noise_std = np.array([[0.2, 1.0], [0.5, 2.0]])
    network = rng.normal(size=(50, 4000, 2, 2)) * 0.3
    truth = rng.normal(size=(4000, 2, 2)) * np.sqrt(noise_std**2 + 0.3**2)
    forecast = draws_only(network)
    halves = [
        GaussianForecast(forecast.mean[h], forecast.variance[h])
        for h in (slice(1000), slice(1000, None))
    ]
    noise = fit_noise(halves, [truth[:1000], truth[1000:]])
    # The mean over draws errs a little itself, by the variance over 50.
    np.testing.assert_allclose(noise.variance, noise_std**2 + 0.3**2 / 50, rtol=0.1)
    assert noise.windows == 4000
    total = with_noise(forecast, noise)
    np.testing.assert_allclose(total.variance, forecast.variance + noise.variance)
    assert np.mean(total.standard_scores(truth) ** 2) == pytest.approx(1.0, abs=0.02)


def test_noise_stays_above_zero_where_draws_spread_more_than_the_errors():
    forecast = GaussianForecast(np.zeros((10, 1, 2)), np.full((10, 1, 2), 9.0))
    truth = np.zeros((10, 1, 2))
    truth[:, :, 0] = 2.0
    noise = fit_noise([forecast], [truth])
    assert noise.variance[0, 0] == pytest.approx(0.01 * 4.0)
    assert noise.variance[0, 1] == pytest.approx(1e-12)


def test_unknown_truths_have_no_part_in_the_noise():
    truth = np.array([1.0, np.nan, 3.0]).reshape(3, 1, 1)
    forecast = GaussianForecast(np.zeros((3, 1, 1)), np.array([1.0, 50.0, 2.0]).reshape(3, 1, 1))
    assert fit_noise([forecast], [truth]).variance[0, 0] == pytest.approx(5.0 - 1.5)
    with pytest.raises(OdisarError, match="1 held-out windows leave a step"):
        fit_noise([GaussianForecast(np.zeros((1, 1, 1)), np.ones((1, 1, 1)))], [truth[1:2]])
    with pytest.raises(OdisarError, match="0 held-out windows"):
        fit_noise([], [])


def test_noise_of_another_horizon_is_refused():
    noise = NoiseFloor(np.ones((4, 3)), 10)
    with pytest.raises(OdisarError, match=r"\(4, 3\) doesn't fit forecasts of \(5, 3\)"):
        with_noise(normal_forecast(), noise)


def test_noise_comes_back_from_json():
    noise = NoiseFloor(np.random.default_rng(0).uniform(size=(3, 2)), 12)
    back = NoiseFloor.from_json(json.loads(json.dumps(noise.as_json())))
    np.testing.assert_array_equal(back.variance, noise.variance)
    assert back.windows == 12


@pytest.mark.parametrize(
    "content",
    [
        {"variance": [[1.0]]},
        {"variance": [[1.0], [2.0, 3.0]], "windows": 3},
        {"variance": [1.0], "windows": 3},
        {"variance": [[0.0]], "windows": 3},
        {"variance": [[float("nan")]], "windows": 3},
    ],
)
def test_what_is_no_noise_is_refused(content):
    with pytest.raises(OdisarError, match="noise floor"):
        NoiseFloor.from_json(content)


def test_a_quantile_has_the_level_it_was_asked_for():
    forecast = normal_forecast()
    for level in (0.01, 0.5, 0.975):
        np.testing.assert_allclose(forecast.levels(forecast.quantiles(level)), level)


def test_the_crps_is_the_integral_of_squared_differences_of_distributions():
    forecast = normal_forecast((3, 2, 1))
    truth = forecast.mean + np.array([-2.0, 0.1, 3.0])[:, None, None]
    values = np.linspace(-40, 40, 400_001)
    for at in np.ndindex(truth.shape):
        one = GaussianForecast(forecast.mean[at], forecast.variance[at])
        integral = np.trapezoid((one.levels(values) - (values >= truth[at])) ** 2, values)
        assert forecast.crps(truth)[at] == pytest.approx(integral, abs=2e-4)


def test_without_spread_the_crps_is_the_absolute_error_and_the_level_a_step():
    forecast = GaussianForecast(np.zeros((3, 1, 1)), np.zeros((3, 1, 1)))
    truth = np.array([-2.0, 0.0, 0.5]).reshape(3, 1, 1)
    np.testing.assert_array_equal(forecast.crps(truth).ravel(), [2.0, 0.0, 0.5])
    np.testing.assert_array_equal(forecast.levels(truth).ravel(), [0.0, 0.5, 1.0])


def test_the_crps_is_that_of_the_uncertainty_toolbox():
    toolbox = pytest.importorskip("uncertainty_toolbox")
    forecast = normal_forecast()
    truth = np.random.default_rng(3).normal(size=forecast.mean.shape)
    published = toolbox.metrics.crps_gaussian(
        forecast.mean.ravel(), forecast.std.ravel(), truth.ravel()
    )
    assert forecast.crps(truth).mean() == pytest.approx(published, rel=1e-12)


def test_disjoint_windows_forecast_no_sample_twice_and_stay_inside_segments():
    info = RecordingInfo("system", disturbance="none", base_seed="0")
    segments = ((0, 60), (60, 100))
    recording = Recording("r", info, np.arange(100.0), np.zeros((100, 1)), segments=segments)
    spec = WindowSpec(context_steps=10, horizon_steps=7, outputs=(0,), commands=(), known_ahead=())
    positions = disjoint_positions(recording, spec)
    forecast = (positions[:, None] + np.arange(1, 8)).ravel()
    assert len(np.unique(forecast)) == len(forecast)
    assert positions[0] == 9
    assert [int(p) for p in positions if p >= 60] == [69, 76, 83, 90]
    assert forecast[forecast < 67].max() < 60
