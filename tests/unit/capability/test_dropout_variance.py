"""The variance of dropout draws as a detector."""

from dataclasses import replace

import numpy as np
import pytest

from odisar.capability.dropout_variance import DropoutVariance
from odisar.capability.scoring import Scorer
from odisar.errors import OdisarError
from small_reference import system_reference
from small_system import SPEC, make_recording

HELD = SPEC.horizon_steps // 4


@pytest.fixture(scope="module")
def detector(trained_twin):
    made = DropoutVariance(trained_twin)
    made.fit(system_reference())
    return made


def variances(twin, recording):
    """Return (window, step, state) population variances of the stored draws."""
    positions = np.arange(SPEC.context_steps - 1, len(recording.time_s), HELD)
    drawn = Scorer(twin, 64, "cpu").draws(recording, positions)
    return positions, drawn.astype(np.float64).var(axis=0)


def test_it_is_the_variance_of_the_stored_draws_in_multiples_of_what_is_usual(
    detector, trained_twin
):
    usual = np.concatenate(
        [variances(trained_twin, item)[1] for item in system_reference().held_out]
    ).mean(axis=0)
    recording = make_recording("test-0", 60)
    (scores,) = detector.score([recording])
    positions, found = variances(trained_twin, recording)
    np.testing.assert_allclose(scores[positions], (found / usual).mean(axis=(1, 2)), rtol=1e-3)
    assert np.isnan(scores[: SPEC.context_steps - 1]).all()
    assert scores[positions[0]] == scores[positions[0] + HELD - 1]


def test_held_out_recordings_are_usual(detector):
    reference = system_reference()
    scores = np.concatenate(detector.score(reference.held_out))
    assert np.nanmean(scores) == pytest.approx(1.0, rel=0.05)


def test_a_twin_that_must_know_commands_is_refused(trained_twin):
    knowing = replace(trained_twin, spec=replace(SPEC, known_ahead=(0,)))
    with pytest.raises(OdisarError, match="must know commands ahead"):
        DropoutVariance(knowing)


def test_it_knows_no_normal_before_it_is_fitted(trained_twin):
    with pytest.raises(OdisarError, match=r"call fit\(\) before score\(\)"):
        DropoutVariance(trained_twin).score([make_recording("test-0", 60)])
