import numpy as np
import pytest
from sklearn.metrics import f1_score, roc_auc_score, roc_curve

from odisar.evaluation.metrics import (
    auroc,
    confusion_of_counts,
    count_confusion,
    tnr_at_tpr95,
)


def drawn(seed, size=997, decimals=None):
    rng = np.random.default_rng(seed)
    labels = rng.random(size) < 0.3
    scores = rng.normal(size=size) + 1.5 * labels
    return (scores if decimals is None else np.round(scores, decimals)), labels


@pytest.mark.parametrize("decimals", [None, 1, 0])
def test_auroc_is_that_of_scikit_learn_with_and_without_ties(decimals):
    scores, labels = drawn(0, decimals=decimals)
    assert auroc(scores, labels) == pytest.approx(roc_auc_score(labels, scores), abs=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_tnr_is_the_papers_rule_without_ties(seed):
    scores, labels = drawn(seed)
    fpr, tpr, _ = roc_curve(labels, scores, drop_intermediate=False)
    distance = np.round(np.abs(tpr - 0.95), 12)
    assert tnr_at_tpr95(scores, labels) == pytest.approx(1 - fpr[np.argmin(distance)], abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("decimals", [1, 0])
def test_tnr_with_ties_lies_on_the_chord_of_the_roc_curve(seed, decimals):
    scores, labels = drawn(seed, decimals=decimals)
    thresholds = np.unique(scores)[::-1]
    hits = [(scores[labels] >= threshold).sum() for threshold in thresholds]
    false_alarms = [(scores[~labels] >= threshold).sum() for threshold in thresholds]
    expected = np.interp(np.round(0.95 * labels.sum()), hits, false_alarms) / (~labels).sum()
    assert tnr_at_tpr95(scores, labels) == pytest.approx(1 - expected)


@pytest.mark.parametrize(("positives", "wanted"), [(10, 9), (20, 19), (30, 28), (100, 95)])
def test_of_two_equally_near_rates_the_lower_counts(positives, wanted):
    # Below every positive lies one negative, so the TNR tells how many positives were taken.
    scores = np.repeat(np.arange(positives, 0, -1.0), 2)
    scores[1::2] -= 0.5
    labels = np.tile([True, False], positives)
    assert tnr_at_tpr95(scores, labels) == pytest.approx(1 - (wanted - 1) / positives)


def test_a_score_of_two_levels_is_judged_on_the_chord_of_its_curve():
    # Three of four disturbed windows known, no false alarm: TPR .95 is .8 of the way from .75 to 1.
    labels = np.array([True] * 400 + [False] * 600)
    scores = np.array([1.0] * 300 + [0.0] * 700)
    assert auroc(scores, labels) == pytest.approx(0.875)
    assert tnr_at_tpr95(scores, labels) == pytest.approx(0.2)


def test_without_both_classes_the_metrics_are_undefined():
    for labels in (np.ones(3, bool), np.zeros(3, bool), np.zeros(0, bool)):
        scores = np.arange(float(len(labels)))
        assert np.isnan(auroc(scores, labels))
        assert np.isnan(tnr_at_tpr95(scores, labels))


def test_f1_is_that_of_scikit_learn_for_both_classes():
    scores, labels = drawn(3)
    flags = scores > 1.0
    confusion = confusion_of_counts(count_confusion(flags, labels))
    assert confusion.f1_ood() == pytest.approx(f1_score(labels, flags))
    assert confusion.f1_ind() == pytest.approx(f1_score(~labels, ~flags))


def test_f1_of_a_class_that_is_neither_there_nor_claimed_is_undefined():
    confusion = confusion_of_counts(count_confusion(np.zeros(4, bool), np.zeros(4, bool)))
    assert np.isnan(confusion.f1_ood())
    assert confusion.f1_ind() == 1.0
