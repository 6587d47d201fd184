import sys
from importlib.util import find_spec

import numpy as np
import pytest
from sklearn.ensemble import IsolationForest as PlainForest

from odisar.baselines.outlyingness import Ecod, IsolationForest
from odisar.baselines.window_statistics import window_statistics
from odisar.errors import OdisarError
from odisar.seeding import derive_seed
from small_reference import CONTEXT, changed, reference_of, system_case, system_reference
from small_system import make_recording

RECORDING = make_recording("scored", 40, push=0.2)
needs_pyod = pytest.mark.skipif(find_spec("pyod") is None, reason="PyOD comes with the study")


@pytest.fixture(scope="module")
def reference():
    return system_reference()


def statistics_of(reference, recordings):
    """Return (context, statistic) of all contexts of some recordings."""
    parts = []
    for recording in recordings:
        samples = reference.scaler.scale(recording.values).astype(float)
        views = np.lib.stride_tricks.sliding_window_view(samples, CONTEXT, axis=0)
        parts.append(window_statistics(np.swapaxes(views, 1, 2)))
    return np.concatenate(parts)


def scores_of(detector, reference, recording=RECORDING):
    detector.fit(reference)
    return detector.score([recording])[0][CONTEXT - 1 :]


def pyod_ecod(reference):
    ecod = pytest.importorskip("pyod.models.ecod").ECOD()
    return ecod.fit(statistics_of(reference, reference.train))


@needs_pyod
def test_ecod_is_what_pyod_says_of_each_window_by_itself(reference):
    theirs = pyod_ecod(reference)
    windows = statistics_of(reference, [RECORDING])
    expected = [theirs.decision_function(window[None])[0] for window in windows]
    np.testing.assert_allclose(scores_of(Ecod(), reference), expected, rtol=1e-9)


@needs_pyod
def test_pyod_itself_lets_a_later_window_move_an_earlier_score(reference):
    theirs = pyod_ecod(reference)
    windows = statistics_of(reference, [RECORDING])
    alone, among = theirs.decision_function(windows[:1])[0], theirs.decision_function(windows)[0]
    assert abs(alone - among) > 1e-3


def test_ecod_counts_a_window_among_those_seen_and_itself():
    recording = make_recording("a", CONTEXT)

    def level(value):
        return changed(recording, np.full_like(recording.values, value))

    reference = reference_of(system_case(), [level(v) for v in (0.0, 1.0, 2.0)], [level(0.0)])
    detector = Ecod()
    detector.fit(reference)
    median, above = (scores[-1] for scores in detector.score([level(1.0), level(3.0)]))
    # Mean and last value of three channels have a rank; spread, slope and range are always zero.
    np.testing.assert_allclose(median, 6 * np.log(4 / 3))
    np.testing.assert_allclose(above, 6 * np.log(4 / 1))


@needs_pyod
def test_isolation_is_the_forest_s_own_share_between_zero_and_one(reference):
    drawn = derive_seed(reference.seed, "isolation-forest") % 2**32
    forest = PlainForest(random_state=drawn).fit(statistics_of(reference, reference.train))
    scores = scores_of(IsolationForest(), reference)
    expected = -forest.score_samples(statistics_of(reference, [RECORDING]))
    np.testing.assert_allclose(scores, expected, rtol=1e-9)
    assert np.all((scores > 0) & (scores < 1))


@pytest.mark.parametrize("detector", [Ecod, pytest.param(IsolationForest, marks=needs_pyod)])
def test_a_push_stands_out(detector, reference):
    fitted = detector()
    fitted.fit(reference)
    calm, pushed = fitted.score([make_recording("a"), make_recording("a", push=0.2)])
    assert np.nanmedian(pushed[120:200]) > np.nanmax(calm)


def test_without_pyod_the_way_out_is_named(reference, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyod.models.iforest", None)
    with pytest.raises(OdisarError, match=r"IForest needs PyOD.*make study-setup"):
        IsolationForest().fit(reference)
