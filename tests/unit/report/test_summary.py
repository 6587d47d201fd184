import numpy as np
import pytest

from odisar.report.failings import failings
from odisar.report.load import Results
from odisar.report.summary import summarise

from .invented import change


def said(results: Results) -> str:
    return " ".join(failings(results, "vessel-all"))


def test_nothing_is_held_against_results_without_a_failing(results):
    assert failings(results, "vessel-all") == ["None of the failings that were looked for."]


def test_a_better_baseline_is_named_with_both_numbers(results):
    change(results, "auroc", "rmse", value=0.991)
    assert "ODiSAR is below forecast RMSE" in said(results)
    assert "at strength 1 AUROC 95.0 against 99.1" in said(results)


def test_a_difference_is_called_beyond_the_intervals_only_if_they_are_apart(results):
    change(results, "auroc", "rmse", value=0.96, ci_low=0.8)
    assert "beyond both intervals" not in said(results)
    change(results, "auroc", "rmse", value=0.99, ci_low=0.98)
    assert "beyond both intervals" in said(results)


def test_an_interval_that_includes_one_half_is_called_a_coin(results):
    change(results, "auroc", value=0.55, ci_low=0.45, ci_high=0.65)
    assert "no better than a coin" in said(results)


def test_values_below_the_published_ones_are_listed(results):
    change(results, "f1_ood", value=0.5)
    assert "below what was published: F1 OOD 50.0 against 90.0" in said(results)


@pytest.mark.parametrize(
    ("value", "low", "high", "words"),
    [
        (3.0, 2.0, 4.0, "was broken"),
        (1.5, 0.5, 3.0, "the interval includes the promise"),
        (0.9, 0.4, 1.5, "too few hours"),
    ],
)
def test_the_promised_rate_is_judged_with_its_interval(results, value, low, high, words):
    change(results, "false_alarms_per_hour", value=value, ci_low=low, ci_high=high)
    assert words in said(results)


def test_missed_events_and_late_alarms_are_told(results):
    change(results, "events_detected", value=0.3)
    change(results, "lead_time_p50_s", value=-7.0)
    assert "fewer than half of the events raised an alarm" in said(results)
    assert "the median alarm comes 7 s after" in said(results)


def test_variance_that_does_not_separate_windows_is_told(results):
    results.quadrants["share_of_disturbed"] = results.quadrants["share_of_undisturbed"]
    assert "Monte Carlo variance does not separate" in said(results)


def test_the_summary_says_how_sure_it_is(results):
    certainty = " ".join(summarise(results).certainty)
    assert "one training seed" in certainty
    assert "8.0 h (vessel-all)" in certainty
    assert "Fewer than 6 h" not in certainty


def test_the_oracle_of_the_papers_protocol_is_explained(results):
    assert any(
        "oracle" in sentence and "90.0 %" in sentence for sentence in summarise(results).reading
    )


def test_results_without_published_values_do_not_speak_of_them(results):
    results.detection["published"] = np.nan
    summary = summarise(results)
    assert "ublished" not in " ".join(summary.reading)
    assert "published" not in said(results)
