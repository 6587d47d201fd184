"""Innovation scores by their formulas, on innovations of a known distribution."""

from dataclasses import replace

import numpy as np
import pytest

from odisar.capability.innovations import (
    InnovationLimit,
    InnovationScore,
    InnovationSize,
    InnovationSteps,
    LogScale,
    MeanInnovation,
    fit_precision,
    moving_mean,
    squared_distance,
)
from odisar.errors import OdisarError
from odisar.seeding import generator

STATES = 3
STEPS = InnovationSteps(mean=10, size=5, recent=3, recent_share=0.3)
#: Standard deviations and a correlation, so that the covariance matters.
ROOT = np.array([[1.0, 0.0, 0.0], [0.6, 0.4, 0.0], [0.0, 0.0, 0.1]])


def usual(name: str, samples: int = 2000) -> np.ndarray:
    """Return (time, state) innovations of the covariance ROOT ROOT'."""
    return generator(5, "innovations", name).normal(size=(samples, STATES)) @ ROOT.T


def rebuilt(name: str, samples: int = 2000) -> np.ndarray:
    """Return (time,) reconstruction errors."""
    return np.exp(generator(5, "rebuilt", name).normal(size=samples))


@pytest.fixture(scope="module")
def score() -> InnovationScore:
    runs = [usual("a"), usual("b", 700)]
    return InnovationScore.fit(runs, [rebuilt("a"), rebuilt("b", 700)], STEPS)


def log_scores(score: InnovationScore, innovations: np.ndarray, error: float = 1.0) -> np.ndarray:
    return np.log(score.score(innovations, np.full(len(innovations), error)))


def test_a_moving_mean_is_that_of_the_last_values_and_unknown_before():
    values = np.arange(12.0).reshape(6, 2)
    means = moving_mean(values, 3)
    assert np.isnan(means[:2]).all()
    for at in range(2, 6):
        np.testing.assert_allclose(means[at], values[at - 2 : at + 1].mean(axis=0))
    assert np.isnan(moving_mean(values[:2], 3)).all()


def test_a_mean_with_a_missing_value_is_missing_and_no_other_is():
    values = np.ones((8, 1))
    values[3] = np.nan
    unknown = np.isnan(moving_mean(values, 3)[:, 0])
    assert np.flatnonzero(unknown).tolist() == [0, 1, 3, 4, 5]


def test_t2_is_the_mean_innovation_in_its_own_covariance():
    run, fresh = usual("a"), usual("fresh", 40)
    part = MeanInnovation.fit([run], 10, None)
    held_out = np.array([run[at - 9 : at + 1].mean(axis=0) for at in range(9, len(run))])
    precision = np.linalg.inv(held_out.T @ held_out / len(held_out))
    found = part.statistic(fresh)
    assert np.isnan(found[:9]).all()
    for at in range(9, 40):
        mean = fresh[at - 9 : at + 1].mean(axis=0)
        assert found[at] == pytest.approx(mean @ precision @ mean, rel=1e-3)


def test_a_limit_leaves_what_is_usual_and_draws_in_what_stands_out():
    run = usual("a")
    limit = InnovationLimit.fit([run[:900], run[900:]])
    distances = np.sqrt(squared_distance(run, fit_precision(run)))
    assert limit.distance == pytest.approx(np.quantile(distances, 0.95))
    far = distances > limit.distance
    kept = limit.of(run)
    np.testing.assert_array_equal(kept[~far], run[~far])
    np.testing.assert_allclose(
        np.sqrt(squared_distance(kept[far], limit.precision)), limit.distance
    )
    # Drawn in along its own direction.
    np.testing.assert_allclose(
        kept[far] / run[far], (limit.distance / distances[far])[:, None] @ np.ones((1, 3))
    )
    assert np.isnan(limit.of(np.full((2, STATES), np.nan))).all()
    np.testing.assert_array_equal(limit.of(np.zeros((2, STATES))), 0.0)


def test_one_start_rules_a_mean_no_longer_and_a_lasting_lean_still_does():
    run, fresh = usual("a"), usual("fresh", 60)
    free = MeanInnovation.fit([run], 10, None)
    limited = MeanInnovation.fit([run], 10, InnovationLimit.fit([run]))
    start, lean = fresh.copy(), fresh.copy()
    start[30] += ROOT @ np.full(STATES, 20.0)
    lean[30:] += ROOT @ np.full(STATES, 0.8)
    during = slice(30, 40)
    assert free.scale.of(free.statistic(start)[during]).min() > 2
    assert limited.scale.of(limited.statistic(start)[during]).max() < 1.2
    assert limited.scale.of(limited.statistic(lean)[45:]).min() > 1


def given_the_others(values, moment, state):
    """Return (time,) squares of what a regression on all other states leaves of one."""
    others = [i for i in range(len(moment)) if i != state]
    slopes = np.linalg.solve(moment[np.ix_(others, others)], moment[others, state])
    left = values[:, state] - values[:, others] @ slopes
    return left**2 / (moment[state, state] - moment[state, others] @ slopes)


def test_the_size_is_that_of_the_state_which_scatters_most_given_the_others():
    run, fresh = usual("a"), usual("fresh", 40) * np.array([1.0, 3.0, 1.0])
    part = InnovationSize.fit([run], 5)
    moment = run.T @ run / len(run)
    logs = [np.log1p(given_the_others(fresh, moment, state)) for state in range(STATES)]
    found = part.statistic(fresh)
    assert np.isnan(found[:4]).all()
    for at in range(4, 40):
        expected = max(state[at - 4 : at + 1].mean() for state in logs)
        assert found[at] == pytest.approx(expected, rel=1e-3)


def test_both_statistics_are_what_they_should_be_on_average():
    """T2 and normalised innovations squared have the number of states as their mean."""
    run = usual("a", 20000)
    assert MeanInnovation.fit([run], 10, None).statistic(run)[9:].mean() == pytest.approx(
        STATES, rel=1e-3
    )
    assert squared_distance(run, fit_precision(run)).mean() == pytest.approx(STATES, rel=1e-3)


def test_no_mean_crosses_from_one_run_into_the_next():
    whole = usual("a", 400)
    apart = MeanInnovation.fit([whole[:200], whole[200:]], 10, None)
    means = np.concatenate([moving_mean(part, 10)[9:] for part in (whole[:200], whole[200:])])
    np.testing.assert_allclose(apart.precision, fit_precision(means))
    assert not np.allclose(
        apart.precision, MeanInnovation.fit([whole], 10, None).precision, rtol=1e-6
    )


def test_the_covariance_is_about_zero_a_lasting_error_counts_as_spread():
    precision = fit_precision(usual("a") + np.array([5.0, 0.0, 0.0]))
    assert np.linalg.inv(precision)[0, 0] == pytest.approx(1.0 + 25.0, rel=0.05)


def test_unknown_innovations_do_not_count_for_a_covariance():
    run = usual("a")
    broken = np.concatenate([np.full((1, STATES), np.nan), run])
    np.testing.assert_array_equal(fit_precision(broken), fit_precision(run))


def test_too_few_innovations_are_refused():
    with pytest.raises(OdisarError, match="3 innovations cannot give the covariance of 3 states"):
        fit_precision(usual("a", 3))
    with pytest.raises(OdisarError, match="add validation recordings"):
        InnovationScore.fit([usual("a", 12)], None, STEPS)
    with pytest.raises(OdisarError, match="0 innovations cannot"):
        InnovationScore.fit([usual("a", 9)] * 9, None, STEPS)


def test_a_state_that_never_moves_keeps_the_precision_finite():
    still = usual("a")
    still[:, 2] = 0.0
    assert np.isfinite(fit_precision(still)).all()


def test_the_log_scale_is_zero_where_half_of_the_time_is_and_one_where_all_but_a_percent_is():
    statistic = np.exp(generator(5, "scale").normal(size=20001))
    scale = LogScale.fit(np.append(statistic, np.nan))
    np.testing.assert_allclose(scale.of(np.quantile(statistic, [0.5, 0.99])), [0, 1], atol=1e-3)
    assert np.isfinite(scale.of(np.zeros(1))).all()
    assert np.isnan(scale.of(np.array([np.nan]))).all()


def test_a_statistic_that_never_varies_gives_a_scale_nevertheless():
    scale = LogScale.fit(np.ones(50))
    assert scale.rare > scale.usual
    np.testing.assert_allclose(scale.of(np.ones(2)), 0.0)


def test_the_score_is_put_together_from_its_parts_as_documented(score):
    innovations, errors = usual("fresh", 60), rebuilt("fresh", 60)
    mean, size = score.parts(innovations)
    held = 0
    for part, whole, newer in (
        (mean, score.mean, score.newer_mean),
        (size, score.size, score.newer_size),
    ):
        said, newly = (one.scale.of(one.statistic(innovations)) for one in (whole, newer))
        np.testing.assert_array_equal(part, np.minimum(said, newly + 0.5))
        held += np.count_nonzero(part < said)
    assert held > 0
    lasting = np.fmax(np.fmax(mean, size), score.reconstruction.of(errors))
    recent = score.recent.scale.of(score.recent.statistic(innovations))
    wanted = np.exp(0.7 * lasting + 0.3 * recent)
    found = score.score(innovations, errors)
    np.testing.assert_allclose(found[10:], wanted[10:])
    assert {int(part.argmax()) for part in np.stack([mean, size])[:, 10:].T} == {0, 1}
    assert (score.reconstruction.of(errors)[10:] == lasting[10:]).any()


@pytest.mark.parametrize(("steps", "half"), [(1, 1), (2, 1), (5, 3), (10, 5)])
def test_the_newer_half_of_a_window_is_fitted_on_the_same_innovations(steps, half):
    runs = [usual("a"), usual("b", 700)]
    score = InnovationScore.fit(runs, None, InnovationSteps(steps, steps, 1, 0.3))
    assert (score.newer_mean.steps, score.newer_size.steps) == (half, half)
    whole = InnovationScore.fit(runs, None, InnovationSteps(half, half, 1, 0.3))
    assert score.newer_mean.scale == whole.mean.scale
    assert score.newer_size.scale == whole.size.scale
    np.testing.assert_array_equal(score.newer_mean.precision, whole.mean.precision)
    np.testing.assert_array_equal(score.newer_mean.limit.precision, whole.mean.limit.precision)


@pytest.mark.parametrize(("part", "ended"), [(0, 49), (1, 47)])
def test_what_only_the_older_half_of_a_window_holds_is_over(score, part, ended):
    """Windows are of ten (mean) and five (size): five and three clean samples are newer halves."""
    innovations = usual("fresh", 200)
    innovations[20:45] += ROOT @ np.full(STATES, 4.0)
    whole = (score.mean, score.size)[part]
    said = whole.scale.of(whole.statistic(innovations))
    held = score.parts(innovations)[part]
    assert (held[30:45] > said[30:45] - 0.2).all()
    assert said[ended] > 1.5
    assert held[ended] < said[ended] - 1


def test_without_a_scale_the_reconstruction_does_not_count():
    runs, fresh = [usual("a")], usual("fresh", 60)
    alone = InnovationScore.fit(runs, None, STEPS)
    assert alone.reconstruction is None
    low, high = alone.score(fresh, np.full(60, 1e-6)), alone.score(fresh, np.full(60, 1e6))
    np.testing.assert_array_equal(low, high)


def test_the_usual_scores_about_one_and_rarely_more_than_e(score):
    scores = score.score(usual("fresh", 5000), rebuilt("fresh", 5000))[10:]
    assert 0.8 < np.median(scores) < 1.8
    assert np.mean(scores > np.e) < 0.03


@pytest.mark.parametrize(
    "steps", [STEPS, InnovationSteps(2, 7, 3, 0.3), InnovationSteps(2, 3, 9, 0.3)]
)
def test_a_score_is_unknown_until_all_statistics_are_known(steps):
    score = InnovationScore.fit([usual("a")], [rebuilt("a")], steps)
    run = np.concatenate([np.full((1, STATES), np.nan), usual("fresh", 59)])
    unknown = np.isnan(score.score(run, rebuilt("fresh", 60)))
    assert unknown[: score.known_after_steps].all()
    assert not unknown[score.known_after_steps :].any()
    assert score.known_after_steps == max(steps.mean, steps.size, steps.recent)


def test_an_unknown_reconstruction_error_leaves_the_score_unknown(score):
    errors = rebuilt("fresh", 60)
    errors[40] = np.nan
    unknown = np.isnan(score.score(usual("fresh", 60), errors))
    assert np.flatnonzero(unknown).tolist() == [*range(9), 40]


def test_a_bias_raises_the_mean_part_and_noise_the_size_part(score):
    base = usual("fresh", 3000)
    before = score.parts(base)[:, 10:].mean(axis=1)
    bias = score.parts(base + ROOT @ np.full(STATES, 0.6))[:, 10:].mean(axis=1) - before
    noise = score.parts(base + 1.5 * usual("more", 3000))[:, 10:].mean(axis=1) - before
    assert bias[0] > 2 * bias[1] > 0
    assert noise[1] > 1.2 * noise[0] > 0


def test_the_recent_part_lets_go_as_soon_as_a_bias_has_ended(score):
    innovations = usual("fresh", 200)
    innovations[50:100] += ROOT @ np.full(STATES, 4.0)
    scores = log_scores(score, innovations)
    patient = replace(score, recent_share=0.0)
    without = log_scores(patient, innovations)
    during, after = slice(60, 100), slice(103, 106)
    assert scores[after].mean() < without[after].mean()
    assert scores[during].mean() - scores[after].mean() > (
        without[during].mean() - without[after].mean()
    )


def test_any_of_the_three_lasting_parts_alone_raises_the_score(score):
    base = usual("fresh", 200)
    calm = np.median(log_scores(score, base)[10:])
    noisy = base * np.where(np.arange(200) % 2, 4.0, -4.0)[:, None]
    assert np.median(log_scores(score, base + ROOT @ np.full(STATES, 2.0))[10:]) > calm + 1
    assert np.median(log_scores(score, noisy)[10:]) > calm + 0.5
    assert np.median(log_scores(score, base, error=1e4)[10:]) > calm + 1


def test_a_score_is_above_zero_and_a_number_whatever_is_observed(score):
    extreme = np.concatenate([np.zeros((20, STATES)), np.full((20, STATES), 1e8)])
    scores = score.score(extreme, np.concatenate([np.zeros(20), np.full(20, 1e8)]))[10:]
    assert np.isfinite(scores).all()
    assert (scores > 0).all()
