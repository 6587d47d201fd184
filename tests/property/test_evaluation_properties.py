"""What holds for any scores: order alone decides the ranking, and higher thresholds flag less."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from odisar.evaluation.alarms import calibrate_operating_threshold, find_alarms
from odisar.evaluation.intervals import Resampler, bin_counts, bin_edges
from odisar.evaluation.metrics import (
    auroc,
    auroc_of_counts,
    confusion_of_counts,
    count_confusion,
    tnr_at_tpr95,
)

# Few distinct values, so that ties are common.
SCORES = hnp.arrays(np.float64, st.integers(2, 60), elements=st.integers(0, 12).map(float))


@st.composite
def labelled(draw):
    scores = draw(SCORES)
    labels = draw(hnp.arrays(np.bool_, len(scores)))
    assume(labels.any() and not labels.all())
    return scores, labels


@given(labelled())
def test_ranking_metrics_see_only_the_order(data):
    scores, labels = data
    for metric in (auroc, tnr_at_tpr95):
        assert metric(np.exp(scores / 3), labels) == pytest.approx(metric(scores, labels))
        assert metric(scores**3 + 5, labels) == pytest.approx(metric(scores, labels))


@given(labelled())
def test_reversed_scores_have_the_rest_of_the_area(data):
    scores, labels = data
    assert auroc(-scores, labels) == pytest.approx(1 - auroc(scores, labels))


@given(labelled())
def test_perfect_separation_is_perfect(data):
    scores, labels = data
    apart = scores + 100.0 * labels
    assert auroc(apart, labels) == 1.0
    assert tnr_at_tpr95(apart, labels) == 1.0
    confusion = confusion_of_counts(count_confusion(apart > 50, labels))
    assert confusion.f1_ood() == confusion.f1_ind() == 1.0


@given(labelled(), st.randoms(use_true_random=False))
def test_the_order_of_samples_has_no_influence(data, random):
    scores, labels = data
    order = list(range(len(scores)))
    random.shuffle(order)
    assert auroc(scores[order], labels[order]) == auroc(scores, labels)
    assert tnr_at_tpr95(scores[order], labels[order]) == tnr_at_tpr95(scores, labels)


@given(labelled())
def test_enough_bins_lose_nothing(data):
    scores, labels = data
    counts = bin_counts(scores, labels, bin_edges(scores, 60))
    assert auroc_of_counts(counts[1], counts[0]) == pytest.approx(auroc(scores, labels))


@given(SCORES, st.integers(-1, 13), st.integers(0, 5))
def test_a_higher_threshold_never_adds_flags(scores, threshold, more):
    assert np.all((scores > threshold) >= (scores > threshold + more))


@given(SCORES, st.integers(1, 5), st.integers(-1, 13))
def test_alarms_are_as_apart_as_their_persistence(scores, width, threshold):
    alarms = find_alarms(scores, threshold, width)
    assert np.all(np.diff(alarms) > width)
    for alarm in alarms:
        assert np.all(scores[alarm - width + 1 : alarm + 1] > threshold)


@given(st.lists(SCORES, min_size=1, max_size=4), st.integers(1, 4), st.floats(0, 400))
def test_the_promised_rate_is_held_at_and_above_the_calibrated_threshold(runs, width, rate):
    assume(max(len(scores) for scores in runs) >= width)
    threshold = calibrate_operating_threshold([(s, 1.0) for s in runs], rate, float(width))
    allowed = rate * sum(len(scores) for scores in runs) / 3600
    for level in np.arange(threshold, 14.0, 0.5):
        assert sum(len(find_alarms(scores, level, width)) for scores in runs) <= allowed


@given(
    st.lists(st.floats(0, 1), min_size=8, max_size=30),
    st.integers(0, 2**32 - 1),
)
@settings(max_examples=50)
def test_the_interval_of_a_mean_lies_within_the_values_and_holds_the_mean(values, seed):
    shares = np.array(values)
    rng = np.random.default_rng(seed)
    names = [str(i) for i in range(len(shares))]
    resampler = Resampler.draw(names, 500, 0.99, rng)
    low, high = resampler.interval(resampler.totals(shares) / len(shares))
    slack = 1e-9
    assert shares.min() - slack <= low <= high <= shares.max() + slack
    assert low - slack <= shares.mean() <= high + slack
