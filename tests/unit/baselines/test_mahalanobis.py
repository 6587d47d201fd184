import numpy as np
from sklearn.covariance import LedoitWolf

from odisar.baselines.mahalanobis import Mahalanobis
from odisar.baselines.window_statistics import window_statistics
from small_reference import CONTEXT, changed, reference_of, system_case, system_reference
from small_system import make_recording


def contexts_of(reference, recording):
    samples = reference.scaler.scale(recording.values).astype(float)
    views = np.lib.stride_tricks.sliding_window_view(samples, CONTEXT, axis=0)
    return np.swapaxes(views, 1, 2)


def test_the_score_is_the_squared_distance_under_the_shrunk_covariance():
    reference, recording = system_reference(), make_recording("scored", 60)
    detector = Mahalanobis()
    detector.fit(reference)
    train = np.concatenate(
        [window_statistics(contexts_of(reference, train)) for train in reference.train]
    )
    mean, std = train.mean(axis=0), train.std(axis=0)
    shrunk = LedoitWolf().fit((train - mean) / std)
    statistics = window_statistics(contexts_of(reference, recording))
    expected = shrunk.mahalanobis((statistics - mean) / std)
    np.testing.assert_allclose(detector.score([recording])[0][CONTEXT - 1 :], expected, rtol=1e-6)


def test_a_push_stands_out():
    detector = Mahalanobis()
    detector.fit(system_reference())
    calm, pushed = detector.score([make_recording("a"), make_recording("a", push=0.2)])
    assert np.nanmedian(pushed[120:200]) > 3 * np.nanmax(calm)


def test_a_command_that_never_moved_in_training_shows_when_it_does():
    def with_command(name, command):
        recording = make_recording(name)
        values = recording.values.copy()
        values[:, 0] = command
        return changed(recording, values)

    train = [with_command(f"train-{i}", 1.0) for i in range(4)]
    detector = Mahalanobis()
    detector.fit(reference_of(system_case(), train, train[:1]))
    still, moved = detector.score([with_command("a", 1.0), with_command("a", 1.1)])
    assert np.isfinite(still[CONTEXT:]).all()
    assert np.nanmin(moved) > 1e6 * np.nanmax(still)
