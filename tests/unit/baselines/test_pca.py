import numpy as np
import pytest
from sklearn.decomposition import PCA

from odisar.baselines.contexts import SMALLEST_SCORE
from odisar.baselines.pca import PcaSpe, PcaT2
from small_reference import CONTEXT, changed, reference_of, system_case, system_reference
from small_system import make_recording

RECORDING = make_recording("scored", 60)


def flat_contexts(reference, recording):
    samples = reference.scaler.scale(recording.values).astype(float)
    views = np.lib.stride_tricks.sliding_window_view(samples, CONTEXT, axis=0)
    return np.swapaxes(views, 1, 2).reshape(len(views), -1)


@pytest.fixture(scope="module")
def reference():
    return system_reference()


@pytest.fixture(scope="module")
def analysis(reference):
    """Components by another solver."""
    train = np.concatenate([flat_contexts(reference, train) for train in reference.train])
    return PCA(n_components=0.95, svd_solver="full").fit(train)


def scores_of(detector, reference, recording=RECORDING):
    detector.fit(reference)
    return detector.score([recording])[0][CONTEXT - 1 :]


def test_t2_counts_each_component_in_its_own_spread(reference, analysis):
    along = analysis.transform(flat_contexts(reference, RECORDING))
    expected = (along**2 / analysis.explained_variance_).sum(axis=1)
    np.testing.assert_allclose(scores_of(PcaT2(), reference), expected, rtol=1e-6)


def test_spe_is_what_the_components_leave_unexplained(reference, analysis):
    contexts = flat_contexts(reference, RECORDING)
    rest = contexts - analysis.inverse_transform(analysis.transform(contexts))
    np.testing.assert_allclose(scores_of(PcaSpe(), reference), (rest**2).sum(axis=1), rtol=1e-6)


def test_a_course_that_the_components_hold_leaves_next_to_nothing():
    # One level and nothing else: a single component explains all of it.
    def level(name, value):
        recording = make_recording(name, 40)
        return changed(recording, np.full_like(recording.values, value))

    train = [level(f"train-{value}", value) for value in (-2.0, -1.0, 1.0, 2.0)]
    reference = reference_of(system_case(), train, train[:1])
    scores = scores_of(PcaSpe(), reference, level("scored", 5.0))
    assert np.all(scores < 1e-6)
    assert np.all(scores >= SMALLEST_SCORE)


@pytest.mark.parametrize("detector", [PcaT2, PcaSpe])
def test_a_push_stands_out(detector, reference):
    fitted = detector()
    fitted.fit(reference)
    calm, pushed = fitted.score([make_recording("a"), make_recording("a", push=0.3)])
    assert np.nanmedian(pushed[120:200]) > np.nanmax(calm)
