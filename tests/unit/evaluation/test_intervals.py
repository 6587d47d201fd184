import numpy as np
import pytest

from odisar.evaluation.intervals import (
    Resampler,
    bin_counts,
    bin_edges,
    shift_interval,
    weighted_quantile,
)


def resampler(clusters, draws=2000, seed=0):
    return Resampler.draw(clusters, draws, 0.95, np.random.default_rng(seed))


def test_rows_of_one_cluster_are_drawn_together():
    item = resampler(["a", "b", "a", "c"])
    weights = item.row_weights()
    np.testing.assert_array_equal(weights[:, 0], weights[:, 2])
    np.testing.assert_array_equal(item.weights.sum(axis=1), 3)


def test_totals_are_weighted_sums_of_rows():
    item = resampler(["a", "b", "a"], draws=50)
    values = np.arange(12.0).reshape(3, 2, 2)
    expected = np.einsum("dr,rij->dij", item.row_weights(), values)
    np.testing.assert_allclose(item.totals(values), expected)


def test_the_order_of_rows_does_not_change_the_draws():
    values = np.array([1.0, 2.0, 5.0, 7.0])
    forth = resampler(list("abcd")).totals(values)
    back = resampler(list("dcba")).totals(values[::-1])
    np.testing.assert_allclose(forth, back)


def test_the_interval_of_a_mean_is_about_the_textbooks():
    values = np.random.default_rng(1).normal(size=200)
    item = resampler([str(i) for i in range(200)], draws=4000)
    low, high = item.interval(item.totals(values) / 200)
    half = 1.96 * values.std() / np.sqrt(200)
    assert low == pytest.approx(values.mean() - half, abs=0.02)
    assert high == pytest.approx(values.mean() + half, abs=0.02)


def test_one_cluster_alone_gives_no_interval():
    item = resampler(["a", "a"])
    assert np.isnan(item.interval(item.totals(np.ones(2)))).all()


def test_undefined_draws_are_left_out_and_infinite_ones_may_be_the_bound():
    item = resampler(["a", "b"])
    drawn = np.concatenate([np.full(10, np.nan), np.arange(80.0), np.full(20, np.inf)])
    assert item.interval(drawn) == (2.0, np.inf)


def test_bins_follow_the_quantiles_and_keep_two_levels_apart():
    edges = bin_edges(np.array([0.0] * 70 + [2.0] * 30), 10)
    np.testing.assert_array_equal(edges, [0, 2])
    counts = bin_counts(np.array([0.0, 2, 2, 0, 0]), np.array([0, 1, 0, 0, 1], bool), edges)
    np.testing.assert_array_equal(counts, [[2, 1], [1, 1]])


def test_every_sample_falls_into_a_bin():
    scores = np.random.default_rng(0).normal(size=1001)
    counts = bin_counts(scores, scores > 1, bin_edges(scores, 50))
    assert counts.shape == (2, 50)
    assert counts.sum() == 1001
    assert counts.sum(axis=0).max() <= 21


def test_a_shifted_share_stays_a_share():
    assert shift_interval((0.9, 0.99), 0.05) == (pytest.approx(0.95), 1.0)


def test_a_quantile_counts_weights_and_may_be_infinite():
    values = np.array([np.inf, 10.0, 20.0])
    weights = np.array([[1.0, 1, 1], [0, 5, 1], [9, 1, 0], [0, 0, 0]])
    np.testing.assert_array_equal(weighted_quantile(values, weights, 0.5), [20, 10, np.inf, np.nan])


def test_nine_of_ten_are_enough_for_the_ninetieth_percentile():
    values = np.append(np.arange(1.0, 10.0), np.inf)
    assert weighted_quantile(values, np.ones((1, 10)), 0.9) == [9.0]
