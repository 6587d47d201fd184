"""How the published score leaks, and what is left of that when it isn't told the future."""

from dataclasses import replace

import numpy as np
import pytest

from odisar.baselines.neural.learning import SharedFit
from odisar.baselines.neural.published_recipe import (
    PUBLISHED_BATCH,
    PublishedRecipe,
    PublishedRecipeLastState,
    fit_published_network,
)
from odisar.errors import OdisarError
from odisar.fitting import FitBudget
from small_reference import changed

from .neural_cases import REFERENCES, cut, with_equal_lengths

STRIDE = 10
BUDGET = FitBudget(steps=6, batch_size=8, learning_rate=3.0e-3, gradient_clip=1.0, validations=2)
KINDS = (PublishedRecipe, PublishedRecipeLastState)


@pytest.fixture(scope="module", params=tuple(REFERENCES))
def reference(request):
    return with_equal_lengths(REFERENCES[request.param]())


@pytest.fixture(scope="module")
def network():
    """Return the fit that both recipes share."""
    return SharedFit(lambda reference: fit_published_network(reference, BUDGET))


@pytest.fixture
def make(network, reference):
    def made(kind, stride_steps=STRIDE):
        detector = kind(network, stride_steps=stride_steps)
        detector.fit(reference)
        return detector

    return made


@pytest.fixture
def one_window(reference):
    """Return a recording that holds one window and nothing else, issued at the sample given."""
    spec = reference.spec
    first = spec.unusable_steps
    stop = first + spec.context_steps + spec.horizon_steps
    return cut(reference.held_out[0], stop), first + spec.context_steps - 1


def with_another_future(recording, at):
    values = recording.values.copy()
    values[at + 1 :] = values[at + 1 :][::-1]
    return changed(recording, values, recording.segments)


def test_the_score_moves_with_the_true_future_alone(make, one_window):
    recording, at = one_window
    detector = make(PublishedRecipe)
    before = detector.score([recording])[0][at]
    after = detector.score([with_another_future(recording, at)])[0][at]
    assert abs(after - before) > 1e-3 * before


def test_told_the_last_state_a_single_window_knows_nothing_of_its_future(make, one_window):
    recording, at = one_window
    detector = make(PublishedRecipeLastState)
    before = detector.score([recording])[0]
    after = detector.score([with_another_future(recording, at)])[0]
    np.testing.assert_array_equal(before, after)
    assert np.isfinite(before[at])


def test_told_the_last_state_the_future_still_leaks_through_later_windows(make, reference):
    recording = reference.held_out[0]
    at = reference.spec.context_steps + reference.spec.unusable_steps - 1
    detector = make(PublishedRecipeLastState)
    before = detector.score([recording])[0][at]
    after = detector.score([with_another_future(recording, at)])[0][at]
    assert abs(after - before) > 1e-3 * before


@pytest.mark.parametrize("kind", KINDS)
def test_the_score_moves_with_another_recording(make, reference, kind):
    first, second = reference.held_out
    detector = make(kind)
    other = changed(second, 2 * second.values)
    before, after = (detector.score([first, item])[0] for item in (second, other))
    known = np.isfinite(before)
    assert np.abs(after - before)[known].max() > 1e-3 * before[known].max()


@pytest.mark.parametrize("kind", KINDS)
def test_samples_without_a_whole_window_have_no_score(make, reference, kind):
    recording = reference.held_out[0]
    scores = make(kind).score([recording])[0]
    known = np.zeros(len(scores), dtype=bool)
    known[reference.spec.issue_positions((0, len(scores)), 1)] = True
    np.testing.assert_array_equal(np.isfinite(scores), known)
    assert np.all(scores[known] > 0)


def test_the_last_score_holds_until_the_next_window(make, reference):
    recording = reference.held_out[0]
    positions = reference.spec.issue_positions((0, len(recording.time_s)), 1)
    scores = make(PublishedRecipe).score([recording])[0][positions]
    np.testing.assert_array_equal(scores, np.repeat(scores[::STRIDE], STRIDE)[: len(scores)])


def test_the_published_windows_have_the_score_of_batches_that_hold_no_others(make, reference):
    length = reference.spec.context_steps + reference.spec.horizon_steps
    coarse, fine = make(PublishedRecipe, length), make(PublishedRecipe, STRIDE)
    at = [
        reference.spec.issue_positions((0, len(recording.time_s)), length)
        for recording in reference.held_out
    ]
    for published, also, positions in zip(
        coarse.score(reference.held_out), fine.score(reference.held_out), at, strict=True
    ):
        np.testing.assert_array_equal(also[positions], published[positions])


def test_windows_of_all_recordings_are_cut_into_the_published_batches(make, reference, monkeypatch):
    detector = make(PublishedRecipe)
    sizes = []
    network = detector._network.forward
    monkeypatch.setattr(
        detector._network,
        "forward",
        lambda context, future: sizes.append(len(context)) or network(context, future),
    )
    recordings = [*reference.train, *reference.held_out] * 3
    detector.score(recordings)
    windows = sum(
        len(reference.spec.issue_positions((0, len(recording.time_s)), STRIDE))
        for recording in recordings
    )
    assert max(sizes) == PUBLISHED_BATCH
    assert sum(sizes) == windows


@pytest.mark.parametrize("kind", KINDS)
def test_recordings_too_short_for_a_window_have_no_score(make, reference, kind):
    length = reference.spec.context_steps + reference.spec.horizon_steps
    short = cut(reference.held_out[0], length - 1)
    assert np.isnan(make(kind).score([short])[0]).all()


def test_a_stride_that_leaves_published_windows_out_is_refused(make):
    with pytest.raises(OdisarError, match="stride_steps=7 must divide the window of 40 steps"):
        make(PublishedRecipe, 7)


def test_a_case_whose_horizon_is_shorter_than_its_context_is_refused(network, reference):
    spec = replace(reference.spec, horizon_steps=10)
    with pytest.raises(OdisarError, match="context_steps=20 must equal horizon_steps=10"):
        PublishedRecipe(network).fit(replace(reference, spec=spec))


def test_a_recipe_says_that_it_was_not_fitted(network, reference):
    with pytest.raises(OdisarError, match="call fit"):
        PublishedRecipe(network).score(reference.held_out)
