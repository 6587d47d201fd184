import numpy as np
import pytest

from odisar.artifacts import read_json, write_json
from odisar.report.failings import failings
from odisar.report.load import Results
from odisar.report.summary import summarise

from .altered import add, change, change_pair, with_faults
from .invented import DISTURBED


def said(results: Results) -> str:
    return " ".join(failings(results, "vessel-all"))


@pytest.fixture
def faultless(results):
    """Results without any of the failings that the invented ones have."""
    results.blame.loc[:, "chance_1"] = 0.0
    results.reliability.loc[results.reliability.distribution == "draws", "value"] = 0.9
    results.rules.loc[results.rules.rule == "sigma", "ci_low"] = 0.2
    return results


def test_nothing_is_held_against_results_without_a_failing(faultless):
    assert failings(faultless, "vessel-all") == ["None of the failings that were looked for."]


def test_a_detector_that_is_clearly_better_is_named_with_the_paired_difference(results):
    change_pair(results, "mahalanobis", "auroc", -0.041, -0.05, -0.03)
    assert (
        "ODiSAR is behind Mahalanobis, window statistics: AUROC (at strengths 0.25, 1; at most "
        "-4.10 [-5.00, -3.00] points at strength 0.25)."
    ) in said(results)


def test_a_difference_whose_interval_includes_zero_is_said_to_be_no_more(results):
    change_pair(results, "rmse", "delay_p50_s", 2.0, -1.0, 4.0)
    assert (
        "ODiSAR is behind forecast RMSE: not beyond the interval in the median delay "
        "(at strengths 0.25, 1)."
    ) in said(results)


def test_the_first_sentence_says_where_the_transformer_adds_and_where_nothing(results):
    first = summarise(results).gains[0]
    assert first.startswith("vessel-all: what the Transformer adds to the rest of the score")
    assert "something in AUROC (+4.00 [+3.00, +5.00] points at strength 0.25)" in first
    assert "the median delay (-0.04 [-0.05, -0.03] s at strength 0.25)" in first
    assert "no difference beyond the 95 % interval in AUROC (at strength 1)" in first
    assert "harms" not in first


def test_harm_of_the_transformer_is_called_that(results):
    change_pair(results, "without-transformer", "f1_ood", -0.02, -0.03, -0.01)
    assert (
        "it harms F1 OOD (at strengths 0.25, 1; at most -2.00 [-3.00, -1.00] points at strength"
    ) in summarise(results).gains[0]


def test_a_gain_without_an_interval_is_left_open(results):
    change_pair(results, "without-transformer", "auroc", 0.02, np.nan, np.nan)
    assert (
        "too few recordings for an interval in AUROC (at strengths 0.25, 1)"
        in (summarise(results).gains[0])
    )


def test_alarms_are_told_with_the_hours_in_which_false_ones_were_counted(results):
    found = " ".join(summarise(results).found["vessel-all"])
    assert "at 0.50 false alarms per hour (0.20 to 0.90) in 8.0 undisturbed hours" in found


def test_the_best_other_detector_is_named(results):
    found = " ".join(summarise(results).found["vessel-all"])
    assert "best other detector: ODiSAR without Transformer +4.00 [+3.00, +5.00] points at" in found


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
    assert "No other detector is clearly better for the others." in text
    assert "current" not in text
    assert "novel" not in text


def test_an_unseen_scenario_tells_that_no_other_detector_sees_it_better(results):
    scored(results, "wind", "odisar", 0.48)
    scored(results, "wind", "rmse", 0.52)
    assert "No other detector is clearly better there." in said(results)


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


def test_draws_that_are_too_sure_are_told_with_their_coverage(results):
    assert "their 90 % intervals hold 30.0 % (25.0 to 35.0) of the truths" in said(results)
    assert "Recalibrated" not in said(results)


def test_recalibrated_intervals_that_do_not_hold_are_told(results):
    table = results.reliability
    rows = (table.distribution == "recalibrated") & (table.metric == "coverage-0.9")
    table.loc[rows, ["value", "ci_low", "ci_high"]] = [0.8, 0.75, 0.85]
    assert "do not hold what they promise: 80.0 % (75.0 to 85.0)" in said(results)


def test_faults_whose_channel_is_named_by_chance_are_told(results):
    assert "as far as the interval tells: stuck 25 % (by chance 20 %, 40 windows)." in said(results)


def test_a_leak_of_a_detector_of_ours_is_told(results):
    assert "Leakage" not in said(results)
    table = results.leakage
    table.loc[(table.detector == "rmse") & (table.probe == "future"), "moved"] = 1
    assert "the score of forecast RMSE moves where it must not (future)" in said(results)


def test_a_threshold_that_is_none_for_alarms_is_told(results):
    assert "(rule 'sigma') is none for alarms: it would raise 2.00 per hour" not in said(results)
    results.rules.loc[results.rules.rule == "sigma", "ci_low"] = 1.5
    assert "(rule 'sigma') is none for alarms: it would raise 2.00 per hour" in said(results)


def test_disturbed_recordings_are_counted_as_such(results):
    assert "tested on 1 disturbed and 1 undisturbed recordings, none" in summarise(results).lead[1]


def test_copies_with_faults_are_not_called_disturbed_recordings(results):
    known = results.examples.recordings
    with_faults(results, "bias 1 sd", "stuck")
    assert (
        "tested on 1 disturbed recordings, 2 copies of 1 undisturbed recordings with injected "
        "faults, and on the 1 themselves, none"
    ) in summarise(results).lead[1]
    known.loc[known.recording == DISTURBED, "is_disturbed"] = False
    assert (
        "tested on 2 copies of 1 undisturbed recordings with injected faults, and on all 2 "
        "undisturbed recordings"
    ) in summarise(results).lead[1]


def test_the_summary_says_how_sure_it_is(results):
    certainty = " ".join(summarise(results).certainty)
    assert "one training seed" in certainty
    assert "8.0 h (vessel-all)" in certainty
    assert "Fewer than 6 h" not in certainty


def test_a_conformal_promise_is_said_to_hold_per_block(results):
    told = [s for s in summarise(results).certainty if s.startswith("The conformal threshold")]
    assert len(told) == 1
    assert "per block of time, not per hour" in told[0]
    assert "at most 27% of fresh blocks raise an alarm" in told[0]
    assert "gave an alarm in 25 % of them, and 0.50 per hour (0.25 to 0.90) in 8.0 h" in told[0]


def test_the_oracle_of_the_papers_protocol_is_explained(results):
    assert any(
        "oracle" in sentence and "90.0 %" in sentence for sentence in summarise(results).reading
    )


def test_results_without_published_values_do_not_speak_of_them(results):
    results.detection["published"] = np.nan
    summary = summarise(results)
    assert "ublished" not in " ".join(summary.reading)
    assert "published" not in said(results)
