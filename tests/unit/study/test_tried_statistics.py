"""Statistics that were tried: right by hand, and blind to what comes later."""

from types import SimpleNamespace

import numpy as np
import pytest

from odisar.recordings.schema import Recording, RecordingInfo
from odisar.study.statistics import exponential_mean, regime_distance
from small_system import SPEC

#: Three channels, of which the last two are states of standard deviation 1.
DATA = SimpleNamespace(spec=SPEC, scaler=SimpleNamespace(std=np.ones(3)))


def test_an_exponential_mean_forgets_by_its_weight():
    means = exponential_mean(np.array([[4.0, 1.0], [0.0, 1.0], [2.0, 1.0]]), 0.5)
    np.testing.assert_allclose(means, [[2.0, 0.5], [1.0, 0.75], [1.5, 0.875]])


def test_a_missing_first_innovation_counts_as_none():
    means = exponential_mean(np.array([[np.nan], [4.0], [0.0]]), 0.25)
    np.testing.assert_allclose(means, [[0.0], [1.0], [0.75]])


def test_an_exponential_mean_does_not_know_what_comes_later():
    values = np.random.default_rng(1).normal(size=(30, 2))
    later = values.copy()
    later[20:] += 100.0
    before, after = exponential_mean(values, 0.3), exponential_mean(later, 0.3)
    np.testing.assert_array_equal(before[:20], after[:20])
    assert (before[20:] != after[20:]).all()


def scored(moving, innovations):
    """Return a recording that moves where it is said, and all its innovations."""
    moving = np.asarray(moving, dtype=np.float64)
    # The command moves throughout and has no say.
    values = np.column_stack([np.ones(len(moving)), 0.1 * np.ones(len(moving)), -moving])
    time_s = np.arange(float(len(moving)))
    item = Recording("r", RecordingInfo("system"), time_s, values)
    return item, SimpleNamespace(innovations=innovations, positions=np.arange(len(moving)))


def even(samples):
    """Return (time, 2) innovations whose second moment is the unit matrix."""
    return np.column_stack([np.ones(samples), np.tile([1.0, -1.0], samples // 2)])


@pytest.fixture(scope="module")
def distance():
    """Return the distance fitted on innovations of 1 at rest, 2 in motion and 3 at a change."""
    samples = np.arange(12 * 40)
    moving = samples // 40 % 2
    changing = (samples >= 40) & (samples % 40 < 10)
    size = np.where(changing, 3.0, 1.0 + moving)
    return regime_distance(DATA, [scored(moving, size[:, None] * even(len(samples)))])


def test_an_innovation_is_held_against_those_of_its_regime(distance):
    found = distance(*scored([0] * 20 + [1] * 20, np.ones((40, 2))))
    expected = [2.0] * 20 + [2 / 9] * 10 + [2 / 4] * 10
    np.testing.assert_allclose(found, expected, rtol=1e-4)


def test_a_regime_is_known_from_what_has_been_seen(distance):
    long = distance(*scored([0] * 20 + [1] * 20, np.ones((40, 2))))
    short = distance(*scored([0] * 20, np.ones((20, 2))))
    np.testing.assert_array_equal(long[:20], short)


def test_only_scored_samples_have_a_distance(distance):
    item, scores = scored([0] * 20 + [1] * 20, np.ones((15, 2)))
    scores.positions = np.arange(25, 40)
    np.testing.assert_allclose(distance(item, scores), [2 / 9] * 5 + [2 / 4] * 10, rtol=1e-4)


def test_a_regime_that_was_hardly_seen_takes_the_covariance_of_all():
    sizes = np.repeat([1.0, 3.0], 100)
    at_rest = regime_distance(DATA, [scored(np.zeros(200), sizes[:, None] * even(200))])
    found = at_rest(*scored(np.ones(30), np.ones((30, 2))))
    np.testing.assert_allclose(found, 2 / ((1 + 9) / 2), rtol=1e-4)
