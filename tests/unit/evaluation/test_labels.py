import numpy as np

from odisar.evaluation.labels import (
    Event,
    keep_outside_guards,
    label_active,
    label_upcoming,
    merge_events,
)
from odisar.recordings.schema import Interval

STORM = (Interval(3.0, 5.0, "storm"),)


def test_an_event_starts_with_its_onset_and_stops_before_its_end():
    labels = label_active(np.arange(7.0), STORM)
    np.testing.assert_array_equal(labels, [0, 0, 0, 1, 1, 0, 0])


def test_upcoming_looks_from_the_next_step_to_the_end_of_the_horizon():
    labels = label_upcoming(np.arange(7.0), STORM, horizon_steps=2, step_s=1.0)
    # At 3 the next step is still disturbed; at 4 it is not, though 4 itself is.
    np.testing.assert_array_equal(labels, [0, 1, 1, 1, 0, 0, 0])


def test_upcoming_is_any_label_among_the_steps_ahead():
    time_s = np.arange(60.0)
    events = (Interval(20.0, 23.0, "a"), Interval(40.0, 41.0, "b"))
    active = label_active(np.arange(80.0), events)
    expected = [active[t + 1 : t + 8].any() for t in range(60)]
    np.testing.assert_array_equal(label_upcoming(time_s, events, 7, 1.0), expected)


def test_sums_of_tenths_meet_the_border_they_stand_on():
    time_s = np.cumsum(np.full(10, 0.1))  # its eighth entry is 0.7999999999999999
    assert time_s[7] < 0.8
    assert label_active(time_s, (Interval(0.8, 0.9, "a"),)).sum() == 1


def test_guards_leave_out_the_rise_and_the_fading():
    keep = keep_outside_guards(np.arange(12.0), (Interval(3.0, 7.0, "a"),), 2.0, 3.0)
    np.testing.assert_array_equal(keep, [1, 1, 1, 0, 0, 1, 1, 0, 0, 0, 1, 1])


def test_touching_intervals_are_one_event():
    intervals = (Interval(8.0, 9.0, "c"), Interval(1.0, 3.0, "a"), Interval(3.0, 5.0, "b"))
    assert merge_events(intervals) == [Event(1.0, 5.0), Event(8.0, 9.0)]
