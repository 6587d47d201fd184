"""A score that has fallen far below its own recent peak lets go."""

import numpy as np
import pytest

from odisar.capability.release import Release


def test_a_share_of_what_it_has_fallen_below_a_strong_peak_is_taken_off():
    found = Release(3, 0.5).of(np.array([0.0, 4.0, 1.0, 1.0, 1.0]))
    # Peak 4; 2.5 is where strong begins, above 1 + 0.5: 1 - (4 - 2.5) / 2.
    np.testing.assert_allclose(found, [0.0, 4.0, 0.25, 0.25, 1.0])


def test_within_an_event_a_score_may_rise_and_fall():
    logs = np.array([4.0, 3.6, 3.5, 3.9, 3.0])
    np.testing.assert_allclose(Release(4, 1.0).of(logs), [4.0, 3.6, 3.5, 3.9, 2.6])


@pytest.mark.parametrize("peak", [0.7, 1.4, 2.5])
def test_what_was_never_strong_is_left_alone(peak):
    logs = np.array([peak, 1.2, 0.3, -0.5, peak])
    np.testing.assert_array_equal(Release(5, 1.0).of(logs), logs)


def test_a_peak_counts_for_so_many_steps_its_own_among_them():
    logs = np.array([5.0, *np.zeros(9)])
    taken = -Release(4, 0.5).of(logs)[1:]
    np.testing.assert_allclose(taken, [1.25, 1.25, 1.25, 0, 0, 0, 0, 0, 0])


def test_nothing_after_a_score_moves_it():
    random = np.random.default_rng(4)
    logs = 3 * random.normal(size=200)
    release = Release(20, 0.7)
    whole = release.of(logs)
    for end in (1, 19, 20, 21, 120):
        np.testing.assert_array_equal(release.of(logs[:end]), whole[:end])


def test_unknown_scores_stay_unknown_and_are_no_peak():
    logs = np.array([np.nan, np.nan, 3.0, 1.0, 1.0])
    found = Release(3, 1.0).of(logs)
    assert np.isnan(found[:2]).all()
    np.testing.assert_allclose(found[2:], [3.0, 0.5, 0.5])


def test_unknown_scores_in_between_hide_no_peak():
    logs = np.array([5.0, np.nan, 1.0, np.nan, 1.0])
    np.testing.assert_allclose(Release(3, 1.0).of(logs), [5.0, np.nan, -1.5, np.nan, 1.0])


def test_infinite_scores_stay_infinite_for_as_long_as_they_last():
    logs = np.array([np.nan, np.inf, np.inf, np.inf, 1.0])
    np.testing.assert_array_equal(Release(2, 1.0).of(logs), logs)


@pytest.mark.parametrize("steps", [3, 4, 10**30])
def test_what_looks_back_further_than_a_run_lasts_knows_all_of_it(steps):
    np.testing.assert_allclose(Release(steps, 0.5).of(np.array([4.0, 1.0, 1.0])), [4, 0.25, 0.25])


def test_a_run_without_a_sample_has_no_score():
    assert Release(3, 0.5).of(np.empty(0)).shape == (0,)


def test_without_a_share_scores_are_as_they_were():
    logs = np.array([9.0, 0.0, 3.0])
    np.testing.assert_array_equal(Release(3, 0.0).of(logs), logs)


def test_it_never_raises_a_score():
    logs = 4 * np.random.default_rng(8).normal(size=500)
    found = Release(30, 0.5).of(logs)
    assert (found <= logs).all()
    assert (found < logs).any()
