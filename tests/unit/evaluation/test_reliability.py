import numpy as np
import pytest

from odisar.capability.distribution import GaussianForecast, draws_only
from odisar.capability.recalibration import RecalibratedForecast, fit_recalibration
from odisar.errors import OdisarError
from odisar.evaluation.reliability import (
    CURVE_COLUMNS,
    RELIABILITY_COLUMNS,
    RecordingForecasts,
    ensemble_crps,
    interval_levels,
    miscalibration_area,
    observed_shares,
    reliability_curves,
    reliability_table,
)

from .evaluation_cases import CONFIG

STATES = ("Speed", "Turn Rate")


def forecast_and_truth(rng, windows=15, steps=4, *, promised=1.0, shared=0.0):
    """Return a forecast that promises so much of the true spread; ``shared`` is an error of all."""
    std = rng.uniform(0.5, 2.0, size=(windows, steps, 2))
    mean = rng.normal(size=std.shape)
    errors = np.sqrt(1 - shared**2) * rng.normal(size=std.shape) + shared * rng.normal()
    return GaussianForecast(mean, (promised * std) ** 2), mean + std * errors


def recordings(count=60, seed=0, *, recalibration=None, **how):
    rng = np.random.default_rng(seed)
    parts = []
    for i in range(count):
        forecast, truth = forecast_and_truth(rng, **how)
        distributions = {"draws-plus-noise": forecast}
        if recalibration is not None:
            distributions["recalibrated"] = RecalibratedForecast(forecast, recalibration)
        parts.append(RecordingForecasts(f"r{i}", f"c{i // 2}", truth, distributions))
    return parts


def table(parts, **more):
    return reliability_table("set-up", parts, STATES, CONFIG, 3, **more)


def value_of(found, distribution, state, metric, column="value"):
    rows = found.set_index(["distribution", "state", "metric"])
    return float(rows.loc[(distribution, state, metric), column])


def test_a_well_specified_forecast_is_calibrated_within_its_interval():
    found = table(recordings())
    for state in (*STATES, "all"):
        assert value_of(found, "draws-plus-noise", state, "miscalibration") < 0.015
        for coverage in (0.5, 0.8, 0.9, 0.95):
            value = value_of(found, "draws-plus-noise", state, f"coverage-{coverage}")
            assert value == pytest.approx(coverage, abs=0.03)
    curves = reliability_curves("set-up", recordings(), STATES, CONFIG, 3)
    held = (curves["ci_low"] <= curves["level"]) & (curves["level"] <= curves["ci_high"])
    assert held.mean() > 0.8


def test_overconfidence_is_detected_and_repaired_on_other_recordings():
    held_out = recordings(seed=1, promised=0.4)
    levels = [part.distributions["draws-plus-noise"].levels(part.truth) for part in held_out]
    found = table(recordings(seed=2, promised=0.4, recalibration=fit_recalibration(levels)))
    for state in (*STATES, "all"):
        assert value_of(found, "draws-plus-noise", state, "coverage-0.9", "ci_high") < 0.6
        assert value_of(found, "draws-plus-noise", state, "miscalibration", "ci_low") > 0.08
        assert value_of(found, "recalibrated", state, "miscalibration") < 0.03
        assert value_of(found, "recalibrated", state, "coverage-0.9") == pytest.approx(
            0.9, abs=0.03
        )
        wide, narrow = (
            value_of(found, name, state, "sharpness")
            for name in ("recalibrated", "draws-plus-noise")
        )
        assert wide == pytest.approx(narrow / 0.4, rel=0.1)
        better, worse = (
            value_of(found, name, state, "crps") for name in ("recalibrated", "draws-plus-noise")
        )
        assert better < worse


def test_the_table_is_tidy_and_pooled_values_count_all_cases_alike():
    parts = recordings(6)
    found = table(parts)
    assert tuple(found.columns) == RELIABILITY_COLUMNS
    assert len(found) == 3 * 7
    assert not found.duplicated(["distribution", "state", "metric"]).any()
    assert set(found["setup"]) == {"set-up"}
    assert set(found["windows"]) == {6 * 15}
    forecasts = [(part.distributions["draws-plus-noise"], part.truth) for part in parts]
    crps = np.concatenate([forecast.crps(truth) for forecast, truth in forecasts])
    std = np.concatenate([forecast.std for forecast, _ in forecasts])
    for state, label in ((0, "Speed"), (1, "Turn Rate"), (slice(None), "all")):
        value = value_of(found, "draws-plus-noise", label, "crps")
        assert value == pytest.approx(crps[..., state].mean())
        value = value_of(found, "draws-plus-noise", label, "sharpness")
        assert value == pytest.approx(std[..., state].mean())


def test_physical_units_stand_beside_scaled_ones_per_state():
    found = table(recordings(6), scale=np.array([2.0, 10.0]))
    for metric in ("sharpness", "crps"):
        for state, factor in zip(STATES, (2.0, 10.0), strict=True):
            for column in ("value", "ci_low", "ci_high"):
                scaled = value_of(found, "draws-plus-noise", state, metric, column)
                physical = value_of(found, "draws-plus-noise", state, f"{metric}-physical", column)
                assert physical == pytest.approx(factor * scaled)
    assert not found["metric"][found["state"] == "all"].str.endswith("physical").any()


def test_unknown_truths_count_nowhere():
    parts = recordings(6)
    gappy = []
    for part in parts:
        forecast = part.distributions["draws-plus-noise"]
        truth = np.concatenate([part.truth, np.full((5, 4, 2), np.nan)])
        wider = [
            np.concatenate([a, np.ones((5, 4, 2))]) for a in (forecast.mean, forecast.variance)
        ]
        gappy.append(
            RecordingForecasts(
                part.name, part.cluster, truth, {"draws-plus-noise": GaussianForecast(*wider)}
            )
        )
    expected, found = table(parts), table(gappy)
    np.testing.assert_allclose(found["value"], expected["value"])
    np.testing.assert_allclose(found["ci_low"], expected["ci_low"])


def test_the_order_of_recordings_does_not_matter_and_the_seed_fixes_the_intervals():
    parts = recordings(8)
    forth, back = table(parts), table(parts[::-1])
    for column in ("value", "ci_low", "ci_high"):
        np.testing.assert_allclose(forth[column], back[column])


def test_intervals_widen_when_the_cases_of_a_recording_err_together():
    def width(shared):
        found = table(recordings(shared=shared))
        return value_of(found, "draws-plus-noise", "all", "coverage-0.8", "ci_high") - value_of(
            found, "draws-plus-noise", "all", "coverage-0.8", "ci_low"
        )

    naive = 2 * 1.96 * np.sqrt(0.8 * 0.2 / (60 * 15 * 4 * 2))
    assert width(0.0) == pytest.approx(naive, rel=0.4)
    assert width(0.8) > 3 * naive


def test_one_cluster_alone_has_values_without_intervals():
    found = table(recordings(2))
    assert np.isfinite(found["value"]).all()
    assert np.isnan(found["ci_low"]).all()


def test_curves_have_nineteen_levels_and_increase():
    curves = reliability_curves("set-up", recordings(6), STATES, CONFIG, 3)
    assert tuple(curves.columns) == CURVE_COLUMNS
    assert list(curves["state"].unique()) == [*STATES, "all"]
    for _, curve in curves.groupby("state"):
        np.testing.assert_allclose(curve["level"], np.arange(1, 20) / 20)
        assert (np.diff(curve["observed"]) >= 0).all()
        assert (curve["ci_low"] <= curve["ci_high"]).all()


def test_a_curve_is_the_share_of_truths_below_quantiles():
    parts = recordings(6, promised=0.5)
    curves = reliability_curves("set-up", parts, STATES, CONFIG, 3)
    for level in (0.05, 0.35, 0.9):
        below = [
            part.truth <= part.distributions["draws-plus-noise"].quantiles(level) for part in parts
        ]
        row = curves[(curves["state"] == "Turn Rate") & (curves["level"] == level)]
        assert row["observed"].item() == pytest.approx(np.concatenate(below)[..., 1].mean())


def test_draws_are_also_scored_as_they_are():
    rng = np.random.default_rng(4)
    parts = []
    for i in range(4):
        draws, truth = rng.normal(size=(8, 10, 3, 2)), rng.normal(size=(10, 3, 2))
        forecast = draws_only(draws)
        distributions = {"draws": forecast, "draws-plus-noise": forecast}
        parts.append(RecordingForecasts(f"r{i}", f"r{i}", truth, distributions, draws))
    found = table(parts)
    fair = np.concatenate([ensemble_crps(part.draws, part.truth, fair=True) for part in parts])
    value = value_of(found, "draws", "Speed", "crps-ensemble")
    assert value == pytest.approx(fair[..., 0].mean())
    noisy = found[found["distribution"] == "draws-plus-noise"]
    assert "crps-ensemble" not in set(noisy["metric"])


def test_the_crps_of_draws_is_their_distance_to_the_truth_less_that_among_them():
    rng = np.random.default_rng(5)
    draws, truth = rng.normal(size=(7, 3, 2, 2)), rng.normal(size=(3, 2, 2))
    to_truth = np.abs(draws - truth).mean(axis=0)
    pairs = np.abs(draws[:, None] - draws[None]).sum(axis=(0, 1))
    plain, fair = (ensemble_crps(draws, truth, fair=fair) for fair in (False, True))
    np.testing.assert_allclose(plain, to_truth - pairs / (2 * 7**2))
    np.testing.assert_allclose(fair, to_truth - pairs / (2 * 7 * 6))


def test_few_fair_draws_score_as_many_do_and_both_as_the_normal_they_come_from():
    rng = np.random.default_rng(6)
    truth = rng.normal(size=(40_000, 1, 1))
    exact = GaussianForecast(np.zeros_like(truth), np.ones_like(truth)).crps(truth).mean()
    few = rng.normal(size=(4, 40_000, 1, 1))
    assert ensemble_crps(few, truth, fair=True).mean() == pytest.approx(exact, abs=0.01)
    assert ensemble_crps(few, truth, fair=False).mean() > exact + 0.1


def test_equal_draws_score_their_absolute_error():
    truth = np.array([-1.0, 2.0]).reshape(2, 1, 1)
    draws = np.full((5, 2, 1, 1), 0.5)
    for fair in (False, True):
        np.testing.assert_allclose(ensemble_crps(draws, truth, fair=fair), np.abs(truth - 0.5))


def test_the_area_counts_both_sides_of_a_crossing():
    expected = np.array([0.0, 0.5, 1.0])
    assert miscalibration_area(expected, np.array([0.0, 0.5, 1.0])) == 0
    assert miscalibration_area(expected, np.ones(3)) == pytest.approx(0.5)
    # Two triangles of height 0.5 and width 0.25 or 0.5, meeting where the curve crosses.
    crossing = np.array([0.5, 0.5, 0.5])
    assert miscalibration_area(expected, crossing) == pytest.approx(0.25)
    assert miscalibration_area(expected[[0, 2]], np.array([0.4, 0.8])) == pytest.approx(
        (0.4**2 + 0.2**2) / 0.6 / 2
    )


@pytest.mark.parametrize(("promised", "shared"), [(1.0, 0.0), (0.4, 0.3), (2.5, 0.6)])
def test_calibration_is_that_of_the_uncertainty_toolbox(promised, shared):
    toolbox = pytest.importorskip("uncertainty_toolbox")
    rng = np.random.default_rng(7)
    forecast, truth = forecast_and_truth(rng, 300, promised=promised, shared=shared)
    levels = forecast.levels(truth)
    flat = [array.ravel() for array in (forecast.mean, forecast.std, truth)]
    grid = np.linspace(0, 1, 100)
    for kind, own in (("interval", interval_levels(levels)), ("quantile", 1 - levels)):
        # The toolbox's quantiles are mirrored: it counts forecast - truth. The area is the same.
        expected, observed = toolbox.get_proportion_lists_vectorized(*flat, prop_type=kind)
        np.testing.assert_allclose(observed, observed_shares(own, expected), atol=1e-3)
        published = toolbox.metrics.miscalibration_area(*flat, prop_type=kind)
        area = miscalibration_area(grid, observed_shares(own, grid))
        assert area == pytest.approx(published, abs=1e-3)
    mirrored = miscalibration_area(grid, observed_shares(levels, grid))
    assert mirrored == pytest.approx(published, abs=1e-3)


def test_the_tables_numbers_are_those_of_the_uncertainty_toolbox():
    toolbox = pytest.importorskip("uncertainty_toolbox")
    parts = recordings(20, seed=8, promised=0.6, shared=0.4)
    found = table(parts)
    forecasts = [(part.distributions["draws-plus-noise"], part.truth) for part in parts]
    mean, std, truth = (
        np.concatenate(arrays)[..., 0].ravel()
        for arrays in (
            [forecast.mean for forecast, _ in forecasts],
            [forecast.std for forecast, _ in forecasts],
            [truth for _, truth in forecasts],
        )
    )

    def ours(metric):
        return value_of(found, "draws-plus-noise", "Speed", metric)

    assert ours("crps") == pytest.approx(toolbox.metrics.crps_gaussian(mean, std, truth))
    area = toolbox.metrics.miscalibration_area(mean, std, truth, num_bins=101, prop_type="quantile")
    assert ours("miscalibration") == pytest.approx(area, abs=2e-3)
    for coverage in (0.5, 0.8, 0.9, 0.95):
        published = toolbox.metrics_calibration.get_proportion_in_interval(
            mean, std, truth, coverage
        )
        assert ours(f"coverage-{coverage}") == pytest.approx(published)
    # The toolbox takes the root of the mean variance; the two differ by the spread of the spreads.
    published = toolbox.metrics.sharpness(std)
    assert ours("sharpness") == pytest.approx(np.sqrt(published**2 - std.var()))


def test_recordings_that_do_not_fit_are_refused():
    parts = recordings(2)
    with pytest.raises(OdisarError, match="at least one recording"):
        table([])
    with pytest.raises(OdisarError, match=r"r0: truths of shape \(15, 4, 2\).*of 1 states"):
        reliability_curves("set-up", parts, ("Speed",), CONFIG, 3)
    other = RecordingForecasts("odd", "c", parts[0].truth, {})
    with pytest.raises(OdisarError, match="odd: distributions"):
        table([parts[0], other])
    with pytest.raises(OdisarError, match="a scale of shape"):
        table(parts, scale=np.ones(3))
