"""The shift of one sensor beside the monitor's mean: what it raises, what holds it back."""

from dataclasses import replace

import numpy as np
import pytest

from invented_scores import (
    HEARING,
    STEPS,
    invented_run,
    invented_scores,
    noise_of,
    shift_of,
)
from odisar.capability.combined import (
    CLOSED_FORM,
    CONSISTENCY,
    ODISAR,
    InnovationScores,
    MeanParts,
)


@pytest.fixture(scope="module")
def scores() -> InnovationScores:
    return invented_scores()


@pytest.mark.parametrize("name", HEARING)
def test_what_holds_a_shift_back_is_the_lasting_part_of_consistency(scores, name):
    run = replace(invented_run("fresh", 300), shifts=lambda values, *_: np.full(len(values), 1e9))
    known = slice(scores.known_after_steps, None)
    mean = scores.scales[name].of(scores.parts.of(run)[name])
    shift = shift_of(scores, run, name)
    heard = np.max([mean, noise_of(scores, run), shift], axis=0)[known]
    assert (heard == shift[known]).mean() > 0.9
    found = np.log(scores.of(run)[name][known])
    np.testing.assert_allclose(found, scores.release.of(heard), rtol=1e-4, atol=1e-5)


def test_a_shift_raises_the_whole_alone_and_none_is_heard_where_none_is_sought(scores):
    run = invented_run("fresh", 300)
    shifted = replace(run, shifts=lambda values, *_: np.full(len(values), 1e6))
    calm, loud, deaf = scores.of(run), scores.of(shifted), replace(scores, shift=None).of(shifted)
    known = slice(scores.known_after_steps, None)
    for name in HEARING:
        assert (loud[name][known] > calm[name][known]).mean() > 0.9
        mean = scores.scales[name].of(scores.parts.of(run)[name])
        wanted = scores.release.of(np.maximum(mean, noise_of(scores, run)))
        np.testing.assert_allclose(deaf[name], np.exp(wanted), rtol=1e-5)
    for name in (CLOSED_FORM, CONSISTENCY):
        np.testing.assert_array_equal(loud[name], calm[name])
    assert invented_scores(replace(STEPS, shift=None)).shift is None


def test_without_a_relation_that_holds_consistency_holds_no_shift_back(scores):
    run = replace(invented_run("fresh", 300), shifts=lambda values, *_: np.full(len(values), 1e9))
    held = scores.of(run)[ODISAR]
    free = replace(scores, parts=replace(scores.parts, share_holding=0.0)).of(run)[ODISAR]
    known = slice(scores.known_after_steps, None)
    assert (free[known] > 10 * held[known]).all()


def test_before_a_shift_can_be_told_the_other_parts_count(scores):
    run = invented_run("fresh", 300)
    unknown = replace(run, shifts=lambda values, *_: np.full(len(values), np.nan))
    np.testing.assert_array_equal(
        scores.of(unknown)[ODISAR], replace(scores, shift=None).of(run)[ODISAR]
    )


def test_shifts_are_sought_by_the_precision_of_the_innovations_they_are_sought_in(scores):
    asked, run = [], invented_run("fresh")

    def shifts(innovations: np.ndarray, precision: np.ndarray, memory: int) -> np.ndarray:
        asked.append((innovations, precision, memory))
        return run.shifts(innovations, precision, memory)

    scores.of(replace(run, shifts=shifts))
    InnovationScores.fit([replace(run, shifts=shifts)], scores.parts.relations, STEPS)
    for parts, pair in (
        (scores.parts, asked[:2]),
        (MeanParts.fit([run], scores.parts.relations, STEPS), asked[2:]),
    ):
        for (values, precision, memory), wanted, part in zip(
            pair, (run.innovations, run.closed_form), (parts.twin, parts.closed_form), strict=True
        ):
            assert values is wanted
            np.testing.assert_array_equal(precision, part.size.precision)
            assert memory == STEPS.shift.memory
