import numpy as np
import pytest

from odisar.baselines import contexts as contexts_module
from odisar.baselines.contexts import SMALLEST_SCORE, ContextDetector
from odisar.errors import OdisarError
from small_reference import CONTEXT, changed, drive_reference, reference_of, system_case
from small_system import make_recording


class LastValue(ContextDetector):
    """Scores by what its context ends with, and keeps what it was fitted on."""

    def _fit_contexts(self, contexts, seed):
        self.contexts, self.seed = contexts, seed

    def _score_contexts(self, contexts):
        return contexts[:, -1, 0]


def counting_reference(*lengths):
    """Return recordings whose first channel counts their samples, from 1,000 times their number."""
    recordings = []
    for number, samples in enumerate(lengths):
        recording = make_recording(f"counting-{number}", samples)
        values = recording.values.copy()
        values[:, 0] = 1000 * number + np.arange(samples)
        recordings.append(changed(recording, values))
    return reference_of(system_case(), recordings, recordings[:1])


def last_values(detector, reference):
    """Return (context,) what the first channel reads at the end of the contexts fitted on."""
    return detector.contexts[:, -1, 0] * reference.scaler.std[0] + reference.scaler.mean[0]


def test_all_contexts_are_fitted_while_they_are_few():
    reference, detector = counting_reference(50, 30), LastValue()
    detector.fit(reference)
    assert detector.contexts.shape == (31 + 11, CONTEXT, 3)
    assert detector.seed == reference.seed
    ends = [*range(CONTEXT - 1, 50), *range(1000 + CONTEXT - 1, 1030)]
    np.testing.assert_allclose(last_values(detector, reference), ends, atol=1e-2)


def test_many_contexts_are_thinned_evenly_across_recordings(monkeypatch):
    monkeypatch.setattr(contexts_module, "_MOST_TRAIN_CONTEXTS", 10)
    reference, detector = counting_reference(50, 30), LastValue()
    detector.fit(reference)
    every_fifth = [*range(CONTEXT - 1, 50), *range(1000 + CONTEXT - 1, 1030)][::5]
    np.testing.assert_allclose(last_values(detector, reference), every_fifth, atol=1e-2)


def test_how_many_contexts_are_taken_at_once_does_not_matter(monkeypatch):
    reference, detector = drive_reference(), LastValue()
    detector.fit(reference)
    whole = detector.score(reference.held_out)
    monkeypatch.setattr(contexts_module, "_CONTEXTS_AT_ONCE", 7)
    np.testing.assert_array_equal(detector.score(reference.held_out), whole)


def test_no_score_is_below_the_smallest():
    reference, detector = counting_reference(50, 30), LastValue()
    detector.fit(reference)
    scores = detector.score(reference.train[:1])[0]
    assert np.nanmin(scores) == SMALLEST_SCORE


def test_nothing_is_scored_before_it_is_fitted():
    with pytest.raises(OdisarError, match=r"LastValue.*fit\(\)"):
        LastValue().score([make_recording("early")])


def test_recordings_shorter_than_a_context_cannot_be_fitted():
    reference = counting_reference(CONTEXT - 1)
    with pytest.raises(OdisarError, match="context of 20 steps"):
        LastValue().fit(reference)
