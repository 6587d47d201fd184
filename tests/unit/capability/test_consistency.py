"""Relations within a sample: found where they are, blind to time, loud where one is broken."""

import numpy as np
import pytest

from odisar.capability.consistency import Consistency
from odisar.errors import OdisarError
from odisar.seeding import generator

NOISE = 0.01


def tied_samples(stream: str, count: int = 2000) -> np.ndarray:
    """Return (time, 3) a command and two states; the second is a curved function of the others."""
    random = generator(7, stream)
    free = random.normal(size=(count, 2))
    bound = 0.5 * free[:, 0] - 0.8 * free[:, 1] + 0.3 * free[:, 0] * free[:, 1]
    bound += 0.2 * free[:, 1] * np.abs(free[:, 1]) + NOISE * random.normal(size=count)
    return np.column_stack([free, bound]).astype(np.float32)


@pytest.fixture(scope="module")
def relations():
    return Consistency.fit(tied_samples("train"), (1, 2))


def test_what_physics_ties_leaves_noise_alone(relations):
    residuals = relations.residuals(tied_samples("fresh"))
    assert residuals.shape == (2000, 2)
    assert residuals[:, 1].std() == pytest.approx(NOISE, rel=0.1)


def test_a_bias_of_one_state_stays_in_its_residual_for_as_long_as_it_lasts(relations):
    sound = tied_samples("fresh")
    biased = sound.copy()
    biased[500:, 2] += 0.5
    shift = relations.residuals(biased)[:, 1] - relations.residuals(sound)[:, 1]
    np.testing.assert_allclose(shift[:500], 0.0, atol=1e-6)
    np.testing.assert_allclose(shift[500:], 0.5, atol=1e-5)


def test_a_state_has_no_part_in_what_is_said_of_it(relations):
    samples = tied_samples("fresh", 50)
    moved = samples.copy()
    moved[:, 1] += 3.0
    said = samples[:, [1, 2]] - relations.residuals(samples)
    after = moved[:, [1, 2]] - relations.residuals(moved)
    np.testing.assert_allclose(after[:, 0], said[:, 0], atol=1e-5)
    assert np.abs(after[:, 1] - said[:, 1]).mean() > 0.5


def test_a_residual_is_of_its_own_sample_alone(relations):
    samples = tied_samples("fresh", 50)
    order = generator(7, "order").permutation(50)
    np.testing.assert_allclose(
        relations.residuals(samples)[order], relations.residuals(samples[order]), atol=1e-12
    )


def test_samples_that_are_not_known_whole_neither_count_nor_have_a_residual(relations):
    samples = tied_samples("train")
    gaps = np.concatenate([np.full((5, 3), np.nan, dtype=np.float32), samples])
    fitted = Consistency.fit(gaps, (1, 2))
    np.testing.assert_allclose(fitted.weights, relations.weights, rtol=1e-9)
    residuals = fitted.residuals(gaps)
    assert np.isnan(residuals[:5]).all()
    assert np.isfinite(residuals[5:]).all()


def test_products_are_left_aside_where_they_say_nothing_of_samples_left_out():
    few = generator(7, "straight").normal(size=(60, 5))
    few[:, 4] = few[:, 0] - few[:, 1] + 0.1 * few[:, 4]
    straight = Consistency.fit(few, (4,))
    assert not straight.weights[0, 5:-1].any()
    np.testing.assert_allclose(straight.weights[0, :4], [1, -1, 0, 0], atol=0.1)
    curved = Consistency.fit(tied_samples("train"), (2,))
    assert np.abs(curved.weights[0, 3:-1]).max() > 0.1


def test_one_state_alone_is_held_against_its_mean():
    values = generator(7, "alone").normal(3.0, 1.0, size=(500, 1))
    residuals = Consistency.fit(values, (0,)).residuals(values)
    np.testing.assert_allclose(residuals, values - values.mean(), atol=1e-4)


def test_two_channels_that_are_the_same_leave_nothing():
    one = generator(7, "same").normal(size=(500, 1))
    residuals = Consistency.fit(np.hstack([one, one]), (0, 1)).residuals(np.hstack([one, one]))
    assert np.abs(residuals).max() < 1e-4


def test_too_few_samples_are_refused_with_both_numbers():
    with pytest.raises(OdisarError, match="4 training samples cannot give the 4 weights"):
        Consistency.fit(tied_samples("few", 4), (1, 2))


def test_a_relation_that_explains_less_than_half_of_fresh_samples_does_not_hold(relations):
    fresh = tied_samples("fresh")
    assert relations.share_holding(fresh) == 1.0
    others = fresh.copy()
    others[:, 2] = generator(7, "apart").normal(size=len(fresh))
    assert relations.share_holding(others) == 0.0
    halves = np.concatenate([fresh, np.full((3, 3), np.nan, dtype=np.float32)])
    assert relations.share_holding(halves) == 1.0


def test_states_that_nothing_ties_have_no_relation_that_holds():
    apart, fresh = (generator(7, name).normal(size=(40, 5)) for name in ("little", "more"))
    assert Consistency.fit(apart, (3, 4)).share_holding(fresh) == 0.0


@pytest.mark.parametrize(("explained", "share"), [(0.4, 0.0), (0.6, 1.0)])
def test_half_of_the_variance_decides_whether_a_relation_holds(explained, share):
    random = generator(7, "half")
    first, own = random.normal(size=(2, 20000))
    second = np.sqrt(explained) * first + np.sqrt(1 - explained) * own
    both = np.column_stack([first, second])
    assert Consistency.fit(both, (1,)).share_holding(both) == share


def test_what_never_moves_has_no_relation_and_no_samples_have_none():
    random = generator(7, "still")
    samples = np.column_stack([random.normal(size=(300, 2)), np.zeros(300)])
    relations = Consistency.fit(samples, (0, 1, 2))
    assert relations.share_holding(samples) == 0.0
    assert relations.share_holding(np.full((3, 3), np.nan)) == 0.0


def test_with_many_channels_relations_are_straight(monkeypatch):
    monkeypatch.setattr("odisar.capability.consistency._MOST_REGRESSORS", 3)
    weights = Consistency.fit(tied_samples("train"), (2,)).weights
    assert not weights[0, 3:-1].any()
    assert weights[0, :2].all()


def test_rows_are_taken_in_parts_to_the_same_numbers(monkeypatch, relations):
    samples = tied_samples("train")
    whole = relations.residuals(samples)
    monkeypatch.setattr("odisar.capability.consistency._CHUNK", 77)
    np.testing.assert_allclose(relations.residuals(samples), whole, atol=1e-12)
    fitted = Consistency.fit(samples, (1, 2)).weights
    np.testing.assert_allclose(fitted, relations.weights, atol=1e-9)
    assert relations.residuals(samples[:0]).shape == (0, 2)
