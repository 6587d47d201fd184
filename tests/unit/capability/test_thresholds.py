import math
from dataclasses import replace

import numpy as np
import pytest

from odisar.capability.thresholds import (
    clusters_needed,
    conformal_threshold,
    log_sigma_threshold,
    longest_shared_block_s,
    sigma_threshold,
)
from odisar.errors import OdisarError

BLOCK_S = 600.0


def runs_with_peaks(peaks, cluster=None, samples=600):
    """Return a run for each peak: low scores, and three in a row at the peak."""
    runs = []
    for number, peak in enumerate(peaks):
        scores = np.full(samples, 0.1)
        scores[300:303] = peak
        runs.append((cluster or f"c{number}", scores, 1.0))
    return runs


def rate_of(alpha, block_s=BLOCK_S):
    """Return the rate at which a Poisson process leaves a block free with chance 1 - alpha."""
    return -math.log1p(-alpha) * 3600 / block_s


def test_sigma_is_the_populations_and_nan_scores_do_not_count():
    assert sigma_threshold(np.array([1.0, 3.0, np.nan]), 3.0) == pytest.approx(2 + 3 * 1)


def test_log_sigma_is_sigma_of_the_logarithms_back_on_the_scale():
    scores = np.exp([1.0, 3.0, np.nan])
    assert log_sigma_threshold(scores, 3.0) == pytest.approx(np.exp(2 + 3 * 1))
    assert log_sigma_threshold(7 * scores, 3.0) == pytest.approx(7 * np.exp(5))


def test_log_sigma_holds_its_share_where_scores_have_a_long_tail():
    scores = np.random.default_rng(0).lognormal(sigma=0.8, size=200_000)
    beyond = np.mean(scores > log_sigma_threshold(scores, 3.0))
    assert beyond == pytest.approx(0.00135, abs=0.0004)
    assert np.mean(scores > sigma_threshold(scores, 3.0)) > 5 * beyond


@pytest.mark.parametrize("rule", [sigma_threshold, log_sigma_threshold])
def test_one_score_sets_no_threshold(rule):
    with pytest.raises(OdisarError, match="1 calibration scores cannot set a threshold"):
        rule(np.array([1.0, np.nan]), 3.0)


def test_a_score_of_zero_has_no_logarithm():
    with pytest.raises(OdisarError, match="score of 0 has no logarithm"):
        log_sigma_threshold(np.array([0.0, 1.0]), 3.0)


@pytest.mark.parametrize(("alpha", "rank"), [(0.5, 5), (0.3, 7), (0.25, 8), (0.11, 9), (0.1, 9)])
def test_the_threshold_is_the_conformal_order_statistic_of_the_peaks(alpha, rank):
    peaks = np.random.default_rng(1).permutation(np.arange(1.0, 10.0))
    found = conformal_threshold(runs_with_peaks(peaks), rate_of(alpha), 3.0, BLOCK_S)
    assert rank == math.ceil(10 * (1 - alpha) - 1e-9)
    assert found.threshold == float(rank)
    assert found.alpha == pytest.approx(alpha)
    assert not found.is_weaker
    assert (found.clusters, found.blocks) == (9, 9)


def test_a_peak_shorter_than_the_persistence_does_not_count():
    runs = runs_with_peaks([5.0, 6.0, 7.0])
    assert conformal_threshold(runs, rate_of(0.3), 3.0, BLOCK_S).threshold == 7.0
    assert conformal_threshold(runs, rate_of(0.3), 4.0, BLOCK_S).threshold == 0.1


def test_a_peak_across_the_border_of_blocks_is_in_the_block_where_it_lasts():
    scores = np.full(20, 0.1)
    scores[8:11] = 5.0
    found = conformal_threshold([("a", scores, 1.0)], 400.0, 3.0, 10.0)
    assert found.blocks == 2
    # Half the weight of the only cluster lies on each block; the higher one bounds the promise.
    assert found.threshold == 5.0
    low = scores.copy()
    low[10] = 0.1
    assert conformal_threshold([("a", low, 1.0)], 400.0, 3.0, 10.0).threshold == 0.1


def test_too_few_clusters_give_the_largest_peak_and_say_what_it_promises():
    runs = runs_with_peaks([3.0, 1.0, 2.0])
    found = conformal_threshold(runs, 1.0, 3.0, BLOCK_S)
    assert found.threshold == 3.0
    assert found.is_weaker
    assert found.alpha == pytest.approx(1 / 4)
    assert found.promised_per_hour == pytest.approx(rate_of(1 / 4))
    assert found.asked_per_hour == 1.0
    assert "weaker than the 1 per hour asked for" in found.promise
    assert "needs 6 independent recordings" in found.promise


@pytest.mark.parametrize(("rate", "block_s"), [(1.0, 600.0), (0.5, 1080.0), (2.0, 3600.0)])
def test_as_many_clusters_as_needed_hold_the_promise_and_one_fewer_does_not(rate, block_s):
    needed = clusters_needed(rate, block_s)
    runs = runs_with_peaks(np.arange(1.0, needed + 1), samples=int(block_s))
    enough = conformal_threshold(runs, rate, 3.0, block_s)
    assert not enough.is_weaker
    assert "weaker" not in enough.promise
    assert enough.promised_per_hour == rate
    if needed > 1:
        assert conformal_threshold(runs[1:], rate, 3.0, block_s).is_weaker


def test_runs_of_one_cluster_count_as_one_observation():
    same = runs_with_peaks([9.0] * 50, cluster="same")
    others = runs_with_peaks([1.0, 2.0, 3.0, 4.0])
    found = conformal_threshold(same + others, rate_of(0.4), 3.0, BLOCK_S)
    assert (found.clusters, found.blocks) == (5, 54)
    # 0.6 of six weights: the fourth of the five clusters, not one of the fifty.
    assert found.threshold == 4.0
    once = conformal_threshold(same[:1] + others, rate_of(0.4), 3.0, BLOCK_S)
    assert found.threshold == once.threshold


def test_blocks_begin_at_the_first_score_and_leave_the_rest_out():
    run = runs_with_peaks([5.0])[0][1]
    late = np.concatenate([np.full(60, np.nan), run, np.full(100, 8.0)])
    found = conformal_threshold([("a", late, 1.0)], 10.0, 3.0, BLOCK_S)
    assert (found.blocks, found.threshold) == (1, 5.0)


@pytest.mark.parametrize("alpha", [0.1, 0.3])
def test_a_fresh_block_alarms_as_seldom_as_promised(alpha):
    random = np.random.default_rng(4)
    beyond = []
    for _ in range(200):
        levels = random.normal(size=(20, 1))
        # Recordings of a cluster are alike; clusters have one, two or three of them.
        peaks = np.exp(levels + 0.3 * random.normal(size=(20, 3)))
        runs = [
            (f"c{i}", np.full(20, peaks[i, j]), 1.0) for i in range(20) for j in range(1 + i % 3)
        ]
        found = conformal_threshold(runs, rate_of(alpha, 20.0), 3.0, 20.0)
        fresh = np.exp(random.normal(size=500) + 0.3 * random.normal(size=500))
        beyond.append(np.mean(fresh > found.threshold))
    assert np.mean(beyond) <= alpha + 0.015
    assert np.mean(beyond) >= alpha - 1 / 21 - 0.015


def test_the_longest_shared_block_is_the_shortest_clusters():
    runs = [
        ("a", np.ones(500), 1.0),
        ("a", np.ones(900), 1.0),
        ("b", np.concatenate([np.full(60, np.nan), np.ones(700)]), 1.0),
        ("c", np.full(100, np.nan), 1.0),
    ]
    assert longest_shared_block_s(runs) == 700.0
    assert conformal_threshold(runs, 9.0, 3.0, 700.0).clusters == 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rate_per_hour": 0.0}, "rate_per_hour=0 must be above zero"),
        ({"block_s": 3.0}, "longer than persistence_s=3"),
        ({"block_s": 601.0}, "no calibration run has 601 s of scores"),
        ({"runs": []}, "no calibration run has 600 s of scores"),
    ],
)
def test_what_cannot_be_promised_is_refused(change, message):
    given = {"runs": runs_with_peaks([1.0]), "rate_per_hour": 1.0, "block_s": BLOCK_S}
    with pytest.raises(OdisarError, match=message):
        conformal_threshold(**{**given, **change}, persistence_s=3.0)


def test_without_scores_there_is_no_block():
    with pytest.raises(OdisarError, match="no calibration run has a score"):
        longest_shared_block_s([("a", np.full(10, np.nan), 1.0)])


def test_the_promise_names_its_terms():
    found = conformal_threshold(runs_with_peaks(range(1, 31)), 1.0, 3.0, BLOCK_S)
    assert found.promise == (
        "at most 15.4% of fresh blocks of 10 min raise an alarm (1 per hour if they come one by "
        "one), as calibrated on 30 blocks of 30 independent recordings"
    )
    assert replace(found, asked_per_hour=0.5).is_weaker
