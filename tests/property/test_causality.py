"""Honesty, on a trained twin: a score at t knows nothing later and nothing of its batch."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from odisar.capability.combined import CLOSED_FORM, ODISAR
from odisar.capability.scoring import DETECTORS
from odisar.recordings.schema import Recording
from odisar.twin.bundle import TrainedTwin
from odisar.windows.scaling import channel_std
from small_innovations import KNOWN_AFTER, small_scorer
from small_system import make_recording

SAMPLES = 120
RECORDING = make_recording("causal", SAMPLES)
LEAD = 5


def with_values(values: np.ndarray) -> Recording:
    return Recording("causal", RECORDING.info, RECORDING.time_s, values)


@pytest.fixture(params=["trained_twin", "relative_twin"])
def twin(request) -> TrainedTwin:
    return request.getfixturevalue(request.param)


def first_position(twin: TrainedTwin) -> int:
    """Return the first sample that has a score."""
    return int(twin.spec.issue_positions((0, SAMPLES), 1)[0])


def all_scores(twin: TrainedTwin, values: np.ndarray, batch: int = 32) -> dict[str, np.ndarray]:
    scores = small_scorer(twin, batch).score(with_values(values), short_lead_steps=LEAD)
    return dict(scores.scores)


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(position=st.integers(40, SAMPLES - 2), push=st.floats(-1e3, 1e3), data=st.data())
def test_nothing_after_t_moves_a_score_at_or_before_t(twin, position, push, data):
    channel = data.draw(st.integers(0, 2))
    changed = RECORDING.values.copy()
    changed[position + 1 :, channel] += push
    before, after = all_scores(twin, RECORDING.values), all_scores(twin, changed)
    upto = position - first_position(twin) + 1
    for detector in DETECTORS:
        np.testing.assert_array_equal(before[detector][:upto], after[detector][:upto])


@pytest.mark.parametrize("detector", DETECTORS)
@pytest.mark.parametrize("position", [60, SAMPLES - 1])
def test_one_sigma_at_t_moves_the_score_at_t(twin, detector, position):
    changed = RECORDING.values.copy()
    changed[position] += channel_std([RECORDING])
    at = position - first_position(twin)
    before = all_scores(twin, RECORDING.values)[detector][at]
    after = all_scores(twin, changed)[detector][at]
    assert abs(after - before) > 1e-4


@pytest.mark.parametrize("batch", [1, 7, 101])
def test_no_score_depends_on_how_windows_are_batched(twin, batch):
    together = all_scores(twin, RECORDING.values)
    otherwise = all_scores(twin, RECORDING.values, batch)
    for detector in DETECTORS:
        np.testing.assert_allclose(together[detector], otherwise[detector], atol=2e-6)


def test_the_variance_of_a_window_depends_on_nothing_later_or_beside_it(twin):
    scorer = small_scorer(twin, 32)
    positions = np.arange(40, 100, 7)
    whole = scorer.variances(with_values(RECORDING.values), positions)
    changed = RECORDING.values.copy()
    changed[62:] += 3
    after = scorer.variances(with_values(changed), positions)
    np.testing.assert_array_equal(whole[positions <= 61], after[positions <= 61])
    assert np.all(whole[positions > 61] != after[positions > 61])
    alone = scorer.variances(with_values(RECORDING.values), positions[3:4])
    np.testing.assert_allclose(alone, whole[3:4], rtol=1e-4)


def test_the_last_sample_of_a_recording_is_scored(twin):
    scores = small_scorer(twin, 32).score(RECORDING, short_lead_steps=LEAD)
    assert scores.positions[-1] == SAMPLES - 1
    for detector in (ODISAR, CLOSED_FORM):
        known = np.isfinite(scores.scores[detector])
        assert not known[:KNOWN_AFTER].any()
        assert known[KNOWN_AFTER:].all()
