import numpy as np
import pytest

from odisar.artifacts import read_json, write_json
from odisar.report.failings import failings
from odisar.report.load import Results
from odisar.report.summary import summarise

from .invented import DISTURBED, add, change, with_faults


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


def scored(results: Results, name: str, detector: str, value: float) -> None:
    low, high = value - 0.05, value + 0.05
    spread = {"value": value, "ci_low": low, "ci_high": high, "strength": 0.5}
    add(results, "auroc", detector, evaluated_on=name, **spread)


def test_scenarios_and_components_that_are_not_seen_are_named_with_value_and_strength(results):
    scored(results, "current", "odisar", 0.95)
    scored(results, "novel", "odisar", np.nan)
    scored(results, "waves", "odisar", 0.59)
    scored(results, "wind", "odisar", 0.48)
    scored(results, "wind", "rmse", 0.75)
    text = said(results)
    assert "waves at strength 0.5: 59.0 % (54.0 to 64.0); wind at strength 0.5: 48.0 %" in text
    assert "48.0 % (43.0 to 53.0), forecast RMSE clearly better with 75.0 %." in text
    assert "Forecast errors are not clearly better for the others." in text
    assert "current" not in text
    assert "novel" not in text


def test_an_unseen_scenario_tells_that_forecast_errors_see_it_no_better(results):
    scored(results, "wind", "odisar", 0.48)
    scored(results, "wind", "rmse", 0.52)
    assert "Forecast errors are not clearly better there." in said(results)


def test_manoeuvres_that_break_the_promise_are_named(results):
    for name, value, low in (("zigzag", 12.0, 8.0), ("random", 1.5, 0.2), ("turning", 0.0, 0.0)):
        spread = {"value": value, "ci_low": low, "ci_high": 18.0}
        add(results, "false_alarms_per_hour", "odisar", evaluated_on=name, **spread)
    text = said(results)
    assert "zigzag 12.00 per hour (8.00 to 18.00), random 1.50 per hour" in text
    assert "(0.20 to 18.00, which includes the promise)" in text
    assert "turning" not in text


def test_late_alarms_of_a_narrowed_set_up_say_what_they_are_measured_against(results):
    results.detection.loc[results.detection.metric == "lead_time_p50_s", "value"] = -7.0
    assert "maneuver random only" in " ".join(failings(results, "vessel-random"))
    assert "only)" not in said(results)


def test_pooled_alarm_thresholds_are_told(results, workspace):
    assert "pools the scores" not in " ".join(summarise(results).certainty)
    limits = read_json(workspace.thresholds("vessel-all"))
    limits["members"]["vessel-all"]["operating_pooled"] = 1
    write_json(workspace.thresholds("vessel-all"), limits)
    assert "a fold (vessel-all) pools the scores" in " ".join(summarise(results).certainty)


def test_missed_events_and_late_alarms_are_told(results):
    change(results, "events_detected", value=0.3)
    change(results, "lead_time_p50_s", value=-7.0)
    assert "fewer than half of the events raised an alarm" in said(results)
    assert "the median alarm comes 7 s after" in said(results)


def test_variance_that_does_not_separate_windows_is_told(results):
    results.quadrants["share_of_disturbed"] = results.quadrants["share_of_undisturbed"]
    assert "Monte Carlo variance does not separate" in said(results)


def test_disturbed_recordings_are_counted_as_such(results):
    assert "tested on 1 disturbed and 1 undisturbed recordings, none" in summarise(results).lead[0]


def test_copies_with_faults_are_not_called_disturbed_recordings(results):
    known = results.examples.recordings
    with_faults(results, "bias 1 sd", "stuck")
    assert (
        "tested on 1 disturbed recordings, 2 copies of 1 undisturbed recordings with injected "
        "faults, and on the 1 themselves, none"
    ) in summarise(results).lead[0]
    known.loc[known.recording == DISTURBED, "is_disturbed"] = False
    assert (
        "tested on 2 copies of 1 undisturbed recordings with injected faults, and on all 2 "
        "undisturbed recordings"
    ) in summarise(results).lead[0]


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
