"""A shift of one state: against every onset and end by hand, remembered, and let go of."""

import numpy as np
import pytest

from odisar.capability.innovations import LogScale
from odisar.capability.responses import StepResponse
from odisar.capability.shifts import ShiftFilter, ShiftSteps, StateShift, _drawn_in
from odisar.seeding import generator

MEMORY = 8
PRECISION = np.array([[2.0, -0.4], [-0.4, 1.0]])


def bent_response() -> StepResponse:
    """Return the response of a closed form of a command and two states, with products."""
    ages = [np.eye(2), [[0.6, 0.1], [0.0, 0.8]], [[0.3, 0.2], [0.1, 0.5]], [[0.2, 0.1], [0.1, 0.3]]]
    products = generator(4, "products").normal(size=(2, 3, 3)) * 0.05
    return StepResponse(
        np.array(ages), products + products.transpose(0, 2, 1), np.full((2, 3), 0.03), (1, 2)
    )


def random_run(name: str, steps: int = 40) -> tuple[np.ndarray, np.ndarray]:
    random = generator(4, name)
    return random.normal(size=(steps, 3)), random.normal(size=(steps, 2))


def ratios(samples, innovations, memory=MEMORY):
    return ShiftFilter(bent_response()).ratios(samples, innovations, PRECISION, memory)


def explained(signature, innovations):
    """Return how much the best size of a signature (time, feature) takes off squared distances."""
    along = np.einsum("tf,fg,tg->", signature, PRECISION, innovations)
    return along**2 / np.einsum("tf,fg,tg->", signature, PRECISION, signature)


def by_hand(samples, innovations, now):
    """Return the ratio at one time, from every onset and every pair of onset and end."""
    left = bent_response().at(samples)
    oldest = len(left) - 1

    def signature(state, onset):
        ages = np.minimum(np.arange(now + 1) - onset, oldest)
        shown = [left[age, t, :, state] if age >= 0 else np.zeros(2) for t, age in enumerate(ages)]
        return np.array(shown)

    seen = innovations[: now + 1]
    lasting, ended = [0.0], [0.0]
    for state in range(2):
        for newer in range(max(0, now - MEMORY + 1), now + 1):
            lasting.append(explained(signature(state, newer), seen))
            # A single wrong sample, or a shift that lasted until its signature no longer changed.
            for lasted in (n for n in (1, *range(oldest, MEMORY)) if n <= newer):
                pulse = signature(state, newer - lasted) - signature(state, newer)
                ended.append(explained(pulse, seen))
    return max(0.0, max(lasting) - max(ended))


@pytest.mark.parametrize("seed", ["one", "two", "three"])
def test_a_ratio_is_that_of_the_best_onset_less_that_of_the_best_onset_and_end(seed):
    samples, innovations = random_run(seed)
    innovations += 3.0 * shifted(samples, 0, 12, 17)
    found = ratios(samples, innovations)
    wanted = [by_hand(samples, innovations, now) for now in range(len(samples))]
    np.testing.assert_allclose(found, wanted, rtol=1e-8, atol=1e-9)
    assert 0 < np.count_nonzero(found) < len(found)


def shifted(samples, state, start, stop):
    """Return quiet innovations with what a shift of one state leaves, from start to stop."""
    left, quiet = bent_response().at(samples), generator(4, "quiet").normal(size=(len(samples), 2))
    innovations = 0.1 * quiet
    for t in range(start, len(samples)):
        innovations[t] += 3.0 * left[min(t - start, len(left) - 1), t, :, state]
        if t >= stop:
            innovations[t] -= 3.0 * left[min(t - stop, len(left) - 1), t, :, state]
    return innovations


@pytest.mark.parametrize("state", [0, 1])
def test_a_shift_is_remembered_while_it_lasts_and_let_go_of_when_it_ends(state):
    samples = 0.3 * random_run("calm", 120)[0]
    found = ratios(samples, shifted(samples, state, 40, 70), memory=60)
    assert found[40:70].min() > 5
    assert found[:40].max() < 1
    # The end shows in the same sample: both steps together are no shift that is still there.
    assert found[70:].max() < 1


def test_the_end_of_a_shift_beyond_the_memory_is_taken_for_another_if_it_left_no_trace():
    gone = StepResponse(np.array([np.eye(2), np.zeros((2, 2))]), *no_products(), (1, 2))
    innovations = 0.1 * generator(4, "quiet").normal(size=(160, 2))
    innovations[[40, 100], 0] += [3.0, -3.0]
    found = ShiftFilter(gone).ratios(np.zeros((160, 3)), innovations, PRECISION, 30)
    assert found[100:130].min() > 5
    assert found[130:].max() < 1
    found = ShiftFilter(gone).ratios(np.zeros((160, 3)), innovations, PRECISION, 70)
    assert found[100:].max() < 1


def no_products() -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((2, 3, 3)), np.zeros((2, 3))


def test_a_ratio_knows_nothing_of_what_comes_later_nor_of_pieces(monkeypatch):
    samples, innovations = random_run("later", 90)
    whole = ratios(samples, innovations)
    np.testing.assert_array_equal(ratios(samples[:50], innovations[:50]), whole[:50])
    # What set in and ended as long ago as can be told counts too.
    innovations = 0.1 * innovations + shifted(0.3 * samples, 0, 20, 27)
    whole = ratios(samples, innovations)
    for chunk in (1, 7):
        monkeypatch.setattr("odisar.capability.shifts._CHUNK", chunk)
        np.testing.assert_allclose(ratios(samples, innovations), whole, atol=1e-10)


@pytest.mark.parametrize("steps", [0, 1, 2, 5, 9])
def test_short_runs_have_ratios_too(steps):
    samples, innovations = random_run("later")
    np.testing.assert_allclose(
        ratios(samples[:steps], innovations[:steps]), ratios(samples, innovations)[:steps]
    )


def test_where_there_is_no_innovation_there_is_no_ratio_and_extreme_ones_blind_nobody():
    samples, innovations = random_run("extreme", 60)
    samples *= 0.1
    quiet = ratios(samples, innovations)
    innovations[0], innovations[20], innovations[30, 1] = np.nan, 1e200, np.nan
    samples[22], samples[23] = np.inf, 1e30
    found = ratios(samples, innovations)
    assert np.flatnonzero(np.isnan(found)).tolist() == [0, 30]
    np.testing.assert_allclose(found[45:], quiet[45:], atol=1e-2)


def test_far_out_innovations_are_drawn_in_along_their_direction():
    precision = np.diag([4.0, 0.25])
    far = np.array([[1e6, 0.0], [0.0, -1e6], [1e6, 4e6], [100.0, 9999.0]])
    wanted = [[5000, 0], [0, -20000], [5000, 20000], [100, 9999]]
    np.testing.assert_allclose(_drawn_in(far, precision), wanted)


@pytest.mark.parametrize("state", [0, 1])
def test_a_single_wrong_sample_is_no_shift(state):
    samples = 0.3 * random_run("calm", 120)[0]
    found = ratios(samples, 3.0 * shifted(samples, state, 40, 41), memory=60)
    assert found[40] > 5
    assert found[41:].max() < 1


def test_the_score_is_the_mean_less_a_margin_no_further_out_than_consistency_and_a_little():
    shift = StateShift(ShiftSteps(MEMORY, 0.2), LogScale(0.5, 1.5), LogScale(0.0, 2.0))
    twin, closed = np.exp([0.5, 1.5, 9.5]) - 1, np.exp([1.0, 4.0, 8.0]) - 1
    alone = [0.5, 2.0, 4.0]
    np.testing.assert_allclose(shift.score(None, closed, None), np.array(alone) - 0.2)
    both = np.array([0.25, 1.5, 6.5])
    np.testing.assert_allclose(shift.score(twin, closed, None), both - 0.2)
    tied = np.array([0.0, -1.0, 3.0])
    np.testing.assert_allclose(shift.score(twin, closed, tied), np.array([0.25, 1.0, 5.0]) - 0.2)


def test_scales_come_from_held_out_ratios_and_what_chance_brings_is_never_rare():
    steps = ShiftSteps(MEMORY, 0.0)
    twin = np.exp(np.linspace(0, 4, 101)) - 1
    fitted = StateShift.fit([twin[:40], twin[40:]], [np.zeros(60), np.full(30, 0.1)], steps)
    assert fitted.twin.usual == pytest.approx(2.0)
    assert fitted.twin.rare == pytest.approx(3.96)
    assert fitted.closed_form == LogScale(0.0, pytest.approx(np.log(7.63), rel=1e-3))
    assert fitted.steps == steps
