"""Distributions of a member: kept as plain numbers, and held only against what was recorded."""

import json
from dataclasses import replace

import numpy as np
import pytest

from odisar.capability.scoring import Scorer
from odisar.errors import OdisarError
from odisar.stages.distributions import Distributions, draw_with_truth
from odisar.stages.members import MemberData
from odisar.windows.scaling import Scaler
from small_bundle import small_case
from small_system import SPEC, make_recording

DRAWS, STEPS, STATES = 6, 4, 2


def drawn(windows, seed):
    """Return draws about zero, and truths that scatter more than they do."""
    random = np.random.default_rng(seed)
    draws = random.normal(scale=0.3, size=(DRAWS, windows, STEPS, STATES)).astype(np.float32)
    truth = random.normal(size=(windows, STEPS, STATES)).astype(np.float32)
    return draws, truth


@pytest.fixture(scope="module")
def fitted():
    return Distributions.fit([drawn(15, 1), drawn(25, 2)], [drawn(30, 3), drawn(40, 4)])


@pytest.fixture(scope="module")
def data():
    train = [make_recording(f"train-{i}", 100) for i in range(2)]
    return MemberData(small_case(), {"train": train}, Scaler.fit(train, SPEC), SPEC)


def test_noise_and_recalibration_are_fitted_on_recordings_of_their_own(fitted):
    assert fitted.noise.windows == 15 + 25
    assert fitted.recalibration.windows == 30 + 40


def test_what_was_fitted_comes_back_from_a_file(fitted):
    written = json.loads(json.dumps(fitted.as_json(), allow_nan=False))
    read = Distributions.from_json(written)
    assert read.as_json() == fitted.as_json()
    given = make_recording("r"), drawn(20, 5)
    one, other = fitted.forecasts(*given), read.forecasts(*given)
    assert list(one.distributions) == list(other.distributions)
    for name, distribution in one.distributions.items():
        for level in (0.05, 0.5, 0.9):
            np.testing.assert_array_equal(
                distribution.quantiles(level), other.distributions[name].quantiles(level)
            )


def test_a_file_of_something_else_is_refused(fitted):
    content = fitted.as_json()
    with pytest.raises(OdisarError, match="not a noise floor"):
        Distributions.from_json(content | {"noise": {}})
    with pytest.raises(OdisarError, match="not a recalibration"):
        Distributions.from_json(content | {"recalibration": {}})


def test_forecasts_stand_beside_what_came_true_and_vary_with_their_cluster(fitted):
    item, (draws, truth) = make_recording("r"), drawn(20, 5)
    of_cluster = replace(item, info=replace(item.info, base_seed="c"))
    alone = replace(item, info=replace(item.info, base_seed=""))
    forecasts = fitted.forecasts(of_cluster, (draws, truth))
    assert (forecasts.name, forecasts.cluster) == ("r", "c")
    assert fitted.forecasts(alone, (draws, truth)).cluster == "r"
    np.testing.assert_array_equal(forecasts.truth, truth)
    np.testing.assert_array_equal(forecasts.draws, draws)


class Asked:
    """A scorer that says which positions it was asked for."""

    def draws(self, _recording, positions):
        """Return the positions as draws."""
        return np.broadcast_to(positions[:, None, None], (DRAWS, len(positions), 1, 1))


def test_windows_whose_horizon_was_not_recorded_are_left_out(data):
    item = replace(make_recording("gap", 100), segments=((0, 50), (60, 100)))
    positions = np.array([25, 39, 40, 49, 80, 89, 90, 99])
    draws, truth = draw_with_truth(Asked(), data, item, positions)
    kept = [25, 39, 80, 89]
    assert draws[0, :, 0, 0].tolist() == kept
    observed = np.stack([item.values[t + 1 : t + 11, 1:] for t in kept])
    np.testing.assert_allclose(data.scaler.unscale_targets(truth), observed, atol=1e-5)


def test_a_truth_that_is_missing_leaves_its_windows_out(data):
    item = make_recording("hole", 60)
    values = item.values.copy()
    values[35, 2] = np.nan
    positions = np.array([24, 25, 34, 35])
    draws, truth = draw_with_truth(Asked(), data, replace(item, values=values), positions)
    assert draws[0, :, 0, 0].tolist() == [24, 35]
    assert np.isfinite(truth).all()


def test_no_window_with_its_horizon_gives_no_draw(data):
    draws, truth = draw_with_truth(Asked(), data, make_recording("short", 30), np.array([25, 29]))
    assert draws.shape[1] == 0
    assert truth.shape == (0, SPEC.horizon_steps, len(SPEC.outputs))


def test_a_twin_draws_for_the_windows_that_are_kept(data, relative_twin):
    scorer = Scorer(relative_twin, 64, "cpu")
    relative = replace(data, scaler=relative_twin.scaler, spec=relative_twin.spec)
    item = make_recording("r", 60)
    draws, truth = draw_with_truth(scorer, relative, item, np.array([30, 45, 55]))
    assert draws.shape == (6, *truth.shape)
    np.testing.assert_array_equal(draws, scorer.draws(item, np.array([30, 45])))
