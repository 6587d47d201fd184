"""What every deployable neural detector holds, on channels and on a relative pose."""

import numpy as np
import pytest

from odisar.baselines.interface import context_positions
from odisar.baselines.neural.gru_twin import GruReconstruction
from odisar.baselines.neural.registry import neural_detectors
from odisar.errors import OdisarError
from odisar.windows.scaling import channel_std
from small_reference import changed
from small_system import make_recording

from .neural_cases import BUDGET, cut


def test_every_sample_with_a_whole_context_has_a_score_above_zero(detector, reference):
    recording = reference.held_out[0]
    (scores,) = detector.score([recording])
    known = np.zeros(len(recording.time_s), dtype=bool)
    known[context_positions(recording, reference.spec)] = True
    np.testing.assert_array_equal(np.isfinite(scores), known)
    assert np.all(scores[known] > 0)


@pytest.mark.parametrize("last", [40, 101, 150])
def test_nothing_after_t_moves_a_score_at_or_before_t(detector, reference, last):
    recording = reference.held_out[0]
    later = recording.values.copy()
    later[last + 1 :] *= -3
    before, after = detector.score([recording])[0], detector.score([changed(recording, later)])[0]
    np.testing.assert_array_equal(before[: last + 1], after[: last + 1])
    assert not np.array_equal(before, after, equal_nan=True)


def test_one_sigma_at_t_moves_the_score_at_t(detector, reference):
    recording = reference.held_out[0]
    positions = context_positions(recording, reference.spec)
    moves = []
    for at in positions[:100:20]:
        moved = recording.values.copy()
        moved[at] += channel_std([recording])
        before, after = (
            detector.score([item])[0][at] for item in (recording, changed(recording, moved))
        )
        moves.append(abs(after - before) / before)
    # Not at every t: a p-value counts windows and may stay when the loss behind it moves.
    assert max(moves) > 1e-3


def test_no_score_depends_on_another_recording(detector, reference):
    first, second = reference.held_out
    alone = detector.score([first])[0]
    together = detector.score([second, first])[1]
    np.testing.assert_array_equal(together, alone)


def test_no_context_crosses_a_gap(detector, reference):
    recording = reference.held_out[0]
    parts = ((0, 70), (70, 80), (80, 200))
    (scores,) = detector.score([cut(recording, 200, parts)])
    first = reference.spec.context_steps - 1 + reference.spec.unusable_steps
    assert np.isnan(scores[70 : 80 + first]).all()
    assert np.isfinite(scores[first:70]).all()
    assert np.isfinite(scores[80 + first :]).all()


def test_a_recording_shorter_than_a_context_has_no_score(detector, reference):
    recording = reference.held_out[0]
    shortest = reference.spec.context_steps + reference.spec.unusable_steps
    assert np.isnan(detector.score([cut(recording, shortest - 1)])[0]).all()
    assert np.isfinite(detector.score([cut(recording, shortest)])[0][-1])


def test_a_detector_says_that_it_was_not_fitted(name, references):
    with pytest.raises(OdisarError, match="call fit"):
        neural_detectors(BUDGET)[name]().score(references["system"].held_out)


def test_between_two_windows_the_last_score_holds(references):
    reference = references["system"]
    every, fourth = GruReconstruction(BUDGET), GruReconstruction(BUDGET, stride_steps=4)
    for detector in (every, fourth):
        detector.fit(reference)
    positions = context_positions(reference.held_out[0], reference.spec)
    scores = every.score(reference.held_out)[0][positions]
    held = np.repeat(scores[::4], 4)[: len(scores)]
    found = fourth.score(reference.held_out)[0][positions]
    np.testing.assert_allclose(found, held, rtol=1e-4)


@pytest.mark.parametrize("system", ["system"])
def test_a_disturbance_scores_above_the_time_before_it(detector):
    recording = make_recording("disturbed", push=0.3)
    (scores,) = detector.score([recording])
    assert np.nanmedian(scores[130:200]) > 1.5 * np.nanmedian(scores[:100])
