import numpy as np
import pytest

from odisar.evaluation.metrics import (
    auroc,
    confusion_of_counts,
    count_confusion,
    tnr_at_tpr95,
)
from odisar.evaluation.protocols import issue_indices, take_samples

from .evaluation_cases import CONFIG, scored

TIMES = np.arange(3.0, 19.0)  # sixteen samples of nineteen, with a context of four


def small(event=(9.0, 12.0), **changes):
    scores = {"odisar": TIMES * 10, "rmse": np.where(TIMES < 6, np.nan, TIMES)}
    return scored(TIMES, scores, event, horizon=3, context=4, **changes)


def test_the_monitor_is_judged_by_the_present_where_all_have_scores():
    samples = take_samples(small(), "P2", CONFIG)
    np.testing.assert_array_equal(samples.scores["odisar"], np.arange(6, 19) * 10)
    np.testing.assert_array_equal(samples.labels, (TIMES[3:] >= 9) & (TIMES[3:] < 12))
    np.testing.assert_array_equal(samples.scores["oracle"] > 1, samples.labels)


def test_guards_come_off_the_monitors_samples():
    cfg = CONFIG.model_copy(update={"guard_start_s": 1.0, "guard_end_s": 2.0})
    samples = take_samples(small(), "P2-guarded", cfg)
    left = np.array([6, 7, 8, 10, 11, 14, 15, 16, 17, 18])
    np.testing.assert_array_equal(samples.scores["rmse"], left)
    np.testing.assert_array_equal(samples.labels, np.isin(left, [10, 11]))


def test_proactive_looks_ahead_and_stops_where_the_horizon_would_pass_the_end():
    samples = take_samples(small(), "proactive", CONFIG)
    np.testing.assert_array_equal(samples.scores["rmse"], np.arange(6, 16))
    np.testing.assert_array_equal(samples.labels, np.isin(np.arange(6, 16), [6, 7, 8, 9, 10]))
    np.testing.assert_array_equal(
        samples.scores["oracle"] > 1, np.isin(np.arange(6, 16), [9, 10, 11])
    )


def test_windows_of_the_paper_lie_end_to_end():
    item = small()
    np.testing.assert_array_equal(item.time_s[issue_indices(item)], [3, 10])
    samples = take_samples(item, "P1", CONFIG)
    np.testing.assert_array_equal(samples.scores["odisar"], [30, 30, 30, 100, 100, 100])
    # The error over the horizon is the online error at its end.
    np.testing.assert_array_equal(samples.scores["rmse"], [6, 6, 6, 13, 13, 13])
    np.testing.assert_array_equal(samples.labels, [0, 0, 0, 1, 0, 0])
    np.testing.assert_array_equal(samples.scores["oracle"] > 1, [0, 0, 0, 1, 1, 1])


def test_windows_start_anew_after_a_gap():
    times = np.concatenate([np.arange(3.0, 12.0), np.arange(100.0, 105.0)])
    item = scored(times, {"odisar": times}, horizon=3, context=4)
    np.testing.assert_array_equal(item.time_s[issue_indices(item)], [3, 100])


def test_a_short_lead_error_is_read_a_short_lead_later():
    times = np.arange(59.0, 400.0)
    item = scored(times, {"rmse-short-lead": times})
    samples = take_samples(item, "P1", CONFIG)
    np.testing.assert_array_equal(np.unique(samples.scores["rmse-short-lead"]), [69, 189, 309])


def test_strided_scores_give_the_same_windows_and_every_step_a_label():
    every = 5.9 + 0.1 * np.arange(600)
    event = (20.0, 40.0)
    fine = scored(every, {"odisar": every}, event, step_s=0.1)
    coarse = scored(every[::2], {"odisar": every[::2]}, event, step_s=0.1)
    a, b = (take_samples(item, "P1", CONFIG) for item in (fine, coarse))
    np.testing.assert_array_equal(a.scores["odisar"], b.scores["odisar"])
    np.testing.assert_array_equal(a.labels, b.labels)
    # Horizons from 18.0 and from 30.0: 40 steps of the first and all 60 of the second.
    assert a.labels.sum() == 100


def test_scores_are_multiples_of_the_recordings_own_threshold():
    samples = take_samples(small(threshold=20.0), "P2", CONFIG)
    np.testing.assert_array_equal(samples.scores["rmse"], np.arange(6, 19) / 20)


def test_an_unknown_protocol_is_refused():
    with pytest.raises(ValueError, match="P2-guarded"):
        take_samples(small(), "P3", CONFIG)


def twenty_minutes(onset=420.0, end=840.0):
    times = np.arange(59.0, 1200.0)
    return scored(times, {"odisar": np.ones_like(times)}, (onset, end))


def test_the_papers_protocol_holds_back_a_detector_that_knows_the_present():
    samples = take_samples(twenty_minutes(), "P1", CONFIG)
    assert len(samples) == 600
    oracle = samples.scores["oracle"]
    confusion = confusion_of_counts(count_confusion(oracle > 1, samples.labels))
    assert auroc(oracle, samples.labels) == pytest.approx(0.875)
    assert confusion.f1_ood() == pytest.approx(6 / 7)
    assert tnr_at_tpr95(oracle, samples.labels) == pytest.approx(0.2)


def test_the_present_says_much_but_not_all_about_the_horizon():
    samples = take_samples(twenty_minutes(), "proactive", CONFIG)
    assert auroc(samples.scores["oracle"], samples.labels) == pytest.approx(0.9367, abs=0.001)
