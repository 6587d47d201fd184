"""Blame along one run: the kind of fault, its onset, and nothing that comes later."""

from dataclasses import replace

import numpy as np
import pytest

from odisar.capability.innovations import InnovationScore, InnovationSteps
from odisar.capability.responses import StepResponse
from odisar.capability.signatures import Signatures
from odisar.seeding import generator


def fitted_score(states: int = 2) -> InnovationScore:
    runs = [generator(4, "runs").normal(size=(500, states)) @ [[1.0, 0.5], [0.0, 0.3]]]
    return InnovationScore.fit(runs, None, InnovationSteps(4, 3, 2, 0.0))


def straight(*ages: list[list[float]]) -> StepResponse:
    """Return the response of a closed form of two states without products and squares."""
    return StepResponse(np.array(ages), np.zeros((2, 2, 2)), np.zeros((2, 2)), (0, 1))


def blamed(signatures, innovations, samples, windows, directions, *, is_rare=False):
    """Return the blame where the monitor's score is rare throughout, or nowhere."""
    rare = np.broadcast_to(is_rare, len(innovations))
    return signatures.blame(innovations, samples, windows, directions, rare)


def taken_away(innovations, signature, precision):
    """Return how far the best size of a signature (time, feature) brings squared distances down."""
    sizes = np.linspace(-20, 20, 40001)
    left = innovations[None] - sizes[:, None, None] * signature[None]
    distances = np.einsum("atf,fg,atg->a", left, precision, left)
    return np.einsum("tf,fg,tg->", innovations, precision, innovations) - distances.min()


def test_blame_is_what_the_best_shift_drift_or_noise_of_a_state_explains():
    score, precision = fitted_score(), fitted_score().size.precision
    ages = [np.eye(2), np.array([[0.7, 0.2], [0.0, 0.9]]), np.array([[0.5, 0.1], [0.0, 0.8]])]
    directions = np.broadcast_to([[1.0, 0.0], [0.0, 2.0]], (12, 2, 2))
    age = np.arange(12)[:, None]
    for spread, push, wanted in (
        (0.05, [2.0, 0.1], "shift"),
        (0.05, age * [0.3, 0.1], "drift"),
        (2.0, [0.0, 0.0], "noise"),
    ):
        innovations = generator(4, wanted).normal(size=(12, 2)) * spread + push
        # The alarm began with the run: any of its samples may be the onset.
        signatures = Signatures(score, straight(*ages))
        samples, windows = np.zeros((12, 2)), np.array([9])
        found = blamed(signatures, innovations, samples, windows, directions)[0]
        best = set()
        for state, direction in enumerate(directions[0]):
            explained = {"shift": [], "drift": [], "noise": []}
            for onset in range(10):
                step = np.array([ages[min(age, 2)] @ direction for age in range(10 - onset)])
                for kind, signature in (("shift", step), ("drift", np.cumsum(step, axis=0))):
                    taken = taken_away(innovations[onset:10], signature, precision)
                    explained[kind].append(taken)
            along = (innovations @ precision @ direction) ** 2 / (direction @ precision @ direction)
            for onset in range(9):
                variance = max(1.0, along[onset:10].mean())
                explained["noise"].append((10 - onset) * (variance - 1 - np.log(variance)))
            most = {kind: max(values) for kind, values in explained.items()}
            best.add(max(most, key=lambda kind: most[kind]))
            assert found[state] == pytest.approx(np.sqrt(max(most.values())), rel=1e-4)
        assert wanted in best


def test_the_onset_is_remembered_as_long_as_the_alarm_lasts_and_no_longer():
    """What stays is the same for both states; the first sample is not."""
    stays = [[1.0, 1.0], [1.0, 1.0]]
    directions = np.broadcast_to(np.eye(2), (60, 2, 2))
    innovations = generator(4, "quiet").normal(size=(60, 2)) @ [[1.0, 0.5], [0.0, 0.3]] * 0.1
    innovations[20] += [0.0, 6.0]
    innovations[21:40] += [6.0, 6.0]
    signatures, samples = Signatures(fitted_score(), straight(np.eye(2), stays)), np.zeros((60, 2))
    during = blamed(signatures, innovations, samples, np.array([24, 30, 39]), directions)
    assert (during[:, 1] > 1.01 * during[:, 0]).all()
    after = blamed(signatures, innovations, samples, np.array([58]), directions)
    assert after.max() < during.max() / 10


def test_the_onset_is_remembered_while_the_score_is_rare_though_these_innovations_forget():
    stays = np.zeros((2, 2))
    directions = np.broadcast_to(np.eye(2), (90, 2, 2))
    innovations = generator(4, "quiet").normal(size=(90, 2)) @ [[1.0, 0.5], [0.0, 0.3]] * 0.1
    innovations[20] += [0.0, 6.0]
    signatures, samples = Signatures(fitted_score(), straight(np.eye(2), stays)), np.zeros((90, 2))
    is_rare = np.zeros(90, dtype=bool)
    is_rare[20:60] = True
    windows = np.array([59, 80])
    held = blamed(signatures, innovations, samples, windows, directions, is_rare=is_rare)
    forgotten = blamed(signatures, innovations, samples, windows, directions)
    assert held[0, 1] > 4
    assert forgotten[0].max() < 1
    np.testing.assert_array_equal(held[1], forgotten[1])


def test_blame_knows_nothing_of_what_comes_later():
    windows = np.arange(4, 20)
    signatures = Signatures(fitted_score(), straight(np.eye(2), 0.5 * np.eye(2)))
    innovations = generator(4, "later").normal(size=(40, 2))
    samples, directions = np.zeros((40, 2)), np.broadcast_to(np.eye(2), (40, 2, 2))
    whole = blamed(signatures, innovations, samples, windows, directions)
    innovations[20:] += 100.0
    again = blamed(signatures, innovations, samples, windows, directions)
    np.testing.assert_array_equal(again, whole)
    cut = blamed(signatures, innovations[:20], samples[:20], windows, directions[:20])
    np.testing.assert_allclose(cut, whole)


def test_the_onset_is_sought_as_far_back_as_either_statistic_looks():
    runs = [generator(4, "long").normal(size=(900, 2))]
    score = InnovationScore.fit(runs, None, InnovationSteps(2, 20, 2, 0.0))
    innovations = generator(4, "calm").normal(size=(60, 2)) * 0.1
    innovations[30] += [0.0, 8.0]
    signatures = Signatures(score, straight(np.eye(2), np.zeros((2, 2))))
    directions = np.broadcast_to(np.eye(2), (60, 2, 2))
    found = blamed(signatures, innovations, np.zeros((60, 2)), np.array([49, 59]), directions)
    assert found[0, 1] > 4
    assert found[1].max() < 1


def test_a_single_sample_is_no_noise():
    innovations = np.zeros((20, 2))
    innovations[10] = [0.0, 9.0]
    directions, samples = np.broadcast_to(np.eye(2), (20, 2, 2)), np.zeros((20, 2))
    signatures = Signatures(fitted_score(), straight(np.eye(2), np.eye(2)))
    found = blamed(signatures, innovations, samples, np.array([10]), directions)[0]
    precision = signatures.score.size.precision
    # A step in it explains as much as there is.
    wanted = (innovations[10] @ precision) ** 2 / np.diag(precision)
    np.testing.assert_allclose(found, np.sqrt(wanted))


def test_a_window_among_others_is_blamed_as_if_it_were_alone(monkeypatch):
    monkeypatch.setattr("odisar.capability.signatures._LONGEST", 130)
    random = generator(4, "pieces")
    innovations, samples = random.normal(size=(400, 2)), random.normal(size=(400, 2))
    innovations[150:250] += [2.0, 0.0]
    windows, directions = np.arange(5, 400, 7), np.broadcast_to(np.eye(2), (400, 2, 2))
    response = replace(straight(np.eye(2), 0.5 * np.eye(2)), squares=np.full((2, 2), 0.1))
    signatures = Signatures(fitted_score(), response)
    together = blamed(signatures, innovations, samples, windows, directions)
    alone = [blamed(signatures, innovations, samples, one, directions) for one in windows[:, None]]
    np.testing.assert_allclose(together, np.concatenate(alone), rtol=1e-9)


def test_an_onset_is_sought_no_further_back_than_the_longest(monkeypatch):
    monkeypatch.setattr("odisar.capability.signatures._LONGEST", 30)
    innovations = np.zeros((120, 2))
    innovations[20] = [0.0, 50.0]
    innovations[21:] = [2.0, 2.0]
    directions, samples = np.broadcast_to(np.eye(2), (120, 2, 2)), np.zeros((120, 2))
    signatures = Signatures(fitted_score(), straight(np.eye(2), np.ones((2, 2))))
    found = blamed(signatures, innovations, samples, np.array([45, 100]), directions)
    assert found[0, 1] > 1.1 * found[0, 0]
    # What set in before is forgotten: what stays is the same for both.
    assert found[1, 1] < 1.05 * found[1, 0]
