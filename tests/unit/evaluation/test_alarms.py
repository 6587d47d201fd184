import numpy as np
import pytest
from scipy.stats import poisson

from odisar.errors import OdisarError
from odisar.evaluation.alarms import (
    AlarmCount,
    alarm_times,
    calibrate_operating_threshold,
    count_alarms,
    find_alarms,
    judge_events,
    persistence_samples,
    poisson_interval,
)

from .evaluation_cases import scored


def alarms_by_hand(scores, threshold, width):
    """Count by the definition: high for ``width`` in a row, silent until the score has fallen."""
    found, row = [], 0
    for i, score in enumerate(scores):
        row = row + 1 if score > threshold else 0
        if row == width:
            found.append(i)
    return found


def test_an_alarm_waits_for_persistence_and_comes_once():
    scores = np.array([0, 2, 2, 0, 2, 2, 2, 2, 2, 0, 2, 2, 2])
    np.testing.assert_array_equal(find_alarms(scores, 1.0, 3), [6, 12])


def test_a_missing_score_ends_the_row():
    scores = np.array([2, 2, np.nan, 2, 2, 2])
    np.testing.assert_array_equal(find_alarms(scores, 1.0, 3), [5])


def test_a_gap_ends_the_row():
    item = scored([0, 1, 10, 11, 12], {"odisar": [2.0] * 5})
    np.testing.assert_array_equal(alarm_times(item, "odisar", 3.0), [12])


def test_alarms_keep_to_the_times_all_detectors_share():
    item = scored(np.arange(6), {"odisar": [2.0] * 6, "rmse": [np.nan, 1, 1, 1, 1, 1]})
    np.testing.assert_array_equal(alarm_times(item, "odisar", 3.0), [3])


@pytest.mark.parametrize(
    ("persistence_s", "spacing_s", "samples"), [(6, 1, 6), (0.5, 0.1, 5), (0.5, 0.2, 3), (1, 5, 1)]
)
def test_persistence_in_samples_is_never_shorter_than_asked(persistence_s, spacing_s, samples):
    assert persistence_samples(persistence_s, spacing_s) == samples


@pytest.mark.parametrize("rate", [0.0, 3.0, 20.0, 60.0])
@pytest.mark.parametrize("seed", range(3))
def test_the_calibrated_threshold_is_the_lowest_that_holds_the_rate_from_there_on(seed, rate):
    rng = np.random.default_rng(seed)
    # Coarse scores, so that ties occur.
    runs = [(np.round(rng.normal(size=n).cumsum() / 3, 1), 10.0) for n in (300, 200, 7)]
    runs[0][0][50:60] = np.nan
    threshold = calibrate_operating_threshold(runs, rate, persistence_s=40.0)
    hours = sum(np.isfinite(s).sum() for s, _ in runs) * 10 / 3600
    candidates = np.unique(np.concatenate([s[np.isfinite(s)] for s, _ in runs]))
    counts = np.array([sum(len(alarms_by_hand(s, c, 4)) for s, _ in runs) for c in candidates])
    within = counts <= rate * hours
    assert within[candidates >= threshold].all()
    below = candidates < threshold
    if below.any() and not within.all():
        assert not within[below][-1]


def test_no_alarm_allowed_gives_the_highest_lasting_score():
    scores = np.array([0, 9, 0, 4, 5, 4, 0.0])
    assert calibrate_operating_threshold([(scores, 1.0)], 0.0, 3.0) == 4.0
    assert len(find_alarms(scores, 4.0, 3)) == 0


def test_calibration_without_a_score_that_lasts_is_refused():
    with pytest.raises(OdisarError, match="persistence_s"):
        calibrate_operating_threshold([(np.ones(3), 1.0)], 1.0, 6.0)
    with pytest.raises(OdisarError, match="persistence_s"):
        calibrate_operating_threshold([], 1.0, 6.0)


@pytest.mark.parametrize("count", [0, 1, 7])
def test_the_poisson_interval_leaves_the_tails_it_promises(count):
    low, high = poisson_interval(count, 0.95)
    assert poisson.cdf(count, high) == pytest.approx(0.025)
    assert low == 0.0 if count == 0 else poisson.sf(count - 1, low) == pytest.approx(0.025)


def test_counts_add_up_to_a_rate_with_its_hours():
    item = scored(np.arange(1800.0), {"odisar": np.tile([0.0] * 450 + [2.0] * 450, 2)})
    total = count_alarms(item, "odisar", 6.0) + count_alarms(item, "odisar", 6.0)
    assert total == AlarmCount(alarms=4, hours=1.0, windows=3600)
    assert total.per_hour == 4.0
    assert total.interval(0.95) == pytest.approx(poisson_interval(4, 0.95))


def test_a_rate_without_hours_is_undefined():
    assert np.isnan(AlarmCount(0, 0.0, 0).per_hour)
    assert np.isnan(AlarmCount(0, 0.0, 0).interval(0.95)).all()


def stormy(high, **changes):
    times = np.arange(100.0)
    scores = np.where(np.isin(times, list(high)), 2.0, 0.0)
    return scored(times, {"odisar": scores}, (40.0, 60.0), **changes)


def test_delay_runs_from_the_onset_to_the_moment_persistence_is_satisfied():
    (outcome,) = judge_events(stormy(range(45, 55), consequence_s=58.0), "odisar", 6.0)
    assert outcome.delay_s == 10.0  # high at 45 .. 50
    assert outcome.lead_s == 8.0


def test_an_alarm_after_the_consequence_has_a_negative_lead():
    (outcome,) = judge_events(stormy(range(45, 55), consequence_s=47.0), "odisar", 6.0)
    assert outcome.lead_s == -3.0


@pytest.mark.parametrize("high", [(), range(30, 60), range(58, 80), range(45, 50)])
def test_none_standing_late_or_short_is_no_detection(high):
    (outcome,) = judge_events(stormy(high, consequence_s=58.0), "odisar", 6.0)
    assert outcome.delay_s == np.inf
    assert np.isnan(outcome.lead_s)


def test_an_event_without_a_scored_time_is_not_judged():
    item = scored(np.arange(70.0, 100.0), {"odisar": np.zeros(30)}, (40.0, 60.0))
    assert judge_events(item, "odisar", 6.0) == []
