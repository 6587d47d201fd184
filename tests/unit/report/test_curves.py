"""Figures that are computed from scores: they say what the tables say."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from odisar.evaluation.metrics import auroc
from odisar.report.figures.delays import course, delay_over_false_alarms
from odisar.report.figures.onsets import envelope, score_around_onset, told_alarms
from odisar.report.figures.ranking import pool_samples, roc_by_strength
from odisar.report.judged import judged_recording, judged_recordings

from .altered import with_faults
from .invented import CLEAN, DISTURBED, score_rows

PERSISTENCE_S = 6.0


@pytest.fixture
def judged(results):
    return judged_recordings(results, "vessel-all")


def test_recordings_are_grouped_by_strength_and_undisturbed_ones_stand_apart(judged):
    assert {n: [r.name for r in own] for n, own in judged.disturbed.items()} == {
        "strength 1": [DISTURBED]
    }
    assert [item.name for item in judged.undisturbed] == [CLEAN]


def test_faults_without_a_strength_are_grouped_by_kind(results, workspace):
    known = results.examples.recordings
    known.loc[known.recording == DISTURBED, "is_overall"] = False
    known["strength"] = np.nan
    with_faults(results, "stuck", "bias 1 sd")
    scores = results.scores("vessel-all")
    copies = [score_rows(f"{CLEAN}-{name}", disturbed=True) for name in ("stuck", "bias 1 sd")]
    pd.concat([scores, *copies]).to_parquet(workspace.scores("vessel-all"))
    assert list(judged_recordings(results, "vessel-all").disturbed) == ["bias", "stuck"]


def test_the_drawn_curve_holds_the_area_of_the_table(results, judged):
    recordings = judged.disturbed["strength 1"]
    samples = pool_samples(results, "vessel-all", recordings, ["odisar", "rmse"])
    # The monitor's first scores are not known: no detector is judged there.
    assert len(samples.labels) == 1130
    assert int(samples.labels.sum()) == 420
    figure = roc_by_strength(results, "vessel-all")
    curves = [line for line in figure.axes[0].lines if line.get_linestyle() == "-"]
    area = np.trapezoid(curves[0].get_ydata(), curves[0].get_xdata())
    assert area == pytest.approx(auroc(samples.scores["odisar"], samples.labels))


def test_an_envelope_rises_after_the_onset_and_tells_the_delay_of_the_alarm(judged):
    found = envelope(judged.disturbed["strength 1"], "odisar", (-60.0, 480.0), PERSISTENCE_S)
    before = found.middle[(found.since_s >= -60) & (found.since_s < 0)]
    later = found.middle[(found.since_s > 20) & (found.since_s < 400)]
    assert np.nanmax(before) < 1.0 < np.nanmin(later)
    # The score rises 10 s after the onset; six samples in a row make an alarm.
    assert found.delays_s == pytest.approx([15.0])
    assert np.all(found.low <= found.high)


def test_an_event_that_raised_no_alarm_is_counted_as_such(judged):
    item = judged.disturbed["strength 1"][0]
    quiet = replace(item, operating_thresholds=dict.fromkeys(item.scores, 9.0))
    found = envelope([quiet], "odisar", (-60.0, 480.0), PERSISTENCE_S)
    assert np.isinf(found.delays_s).all()


def test_higher_thresholds_cost_fewer_false_alarms_and_more_time(judged):
    found = course(judged, "odisar", PERSISTENCE_S)
    assert found.multiples[0] == 1.0
    assert found.per_hour[-1] == 0.0
    assert found.per_hour[0] <= found.per_hour[1:].max()
    delays = found.delays_s["strength 1"]
    assert delays[0] == 15.0
    assert np.all(np.diff(found.multiples[1:]) > 0)
    assert delays[-1] >= delays[0]


def test_the_operating_point_is_marked_for_every_detector(results):
    axes = delay_over_false_alarms(results, "vessel-all").axes[0]
    marks = [line for line in axes.lines if line.get_marker() not in ("None", "", None)]
    assert len(marks) == 5
    assert marks[0].get_ydata()[0] == 15.0


def test_alarms_are_counted_above_each_panel(results):
    figure = score_around_onset(results, "vessel-all")
    assert figure.axes[0].get_title() == "strength 1\n1 of 1 alarmed,\np50 15 s"


def test_a_median_event_without_alarm_has_no_delay():
    delays = np.array([3.0, np.inf, np.inf])
    assert told_alarms(delays) == "1 of 3 alarmed"


def test_one_recording_is_the_same_alone(results, judged):
    alone = judged_recording(results, "vessel-all", DISTURBED)
    together = judged.disturbed["strength 1"][0]
    np.testing.assert_array_equal(alone.scores["rmse"], together.scores["rmse"])
    assert alone.intervals == together.intervals
