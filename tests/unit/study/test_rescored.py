"""Scores that were put away come back, and are judged as the pipeline judges its own."""

from types import SimpleNamespace

import numpy as np
import pytest

from odisar.errors import OdisarError
from odisar.evaluation.scored import ScoredRecording
from odisar.recordings.schema import Recording, RecordingInfo
from odisar.study.rescored import Judged, judge_scores, read_judged, with_detectors, write_judged

CONFIG = SimpleNamespace(
    capability=SimpleNamespace(threshold_sigmas=3.0),
    evaluation=SimpleNamespace(
        operating_point=SimpleNamespace(promised_per_hour=1.0, set_to_share_of_promise=0.5)
    ),
)


def recording(name, samples=100, segments=(), start_s=0.0):
    time_s = start_s + np.arange(float(samples))
    values = np.zeros((samples, 1))
    return Recording(name, RecordingInfo("system"), time_s, values, segments=segments)


def member(calibration, test=()):
    """Return recordings at 1 Hz of which an alarm must last 3 s."""
    case = SimpleNamespace(rate_hz=1.0, persistence_s=3.0)
    return SimpleNamespace(case=case, splits={"calibration": calibration, "test": list(test)})


def alternating(samples=100):
    """Return 1, 3, 1, 3, ...: mean 2, standard deviation 1."""
    return np.tile([1.0, 3.0], samples // 2)


def test_detectors_come_back_as_they_were_written(tmp_path):
    written = {
        "second": Judged(2.5, 3.5, {"b": np.array([np.nan, 1.5, 2.0]), "a": np.array([0.5, 4.0])}),
        "first": Judged(1.0, 0.25, {"b": np.array([1.0, 1.0, 8.0]), "a": np.array([np.nan, 1.0])}),
    }
    write_judged(tmp_path / "new/folder", written)
    read = read_judged(tmp_path / "new/folder")
    assert list(read) == ["first", "second"]
    for name, one in read.items():
        assert (one.sigma, one.operating) == (written[name].sigma, written[name].operating)
        assert list(one.scores) == ["b", "a"]
        for item, scores in one.scores.items():
            np.testing.assert_array_equal(scores, written[name].scores[item])
            assert scores.dtype == np.float64


def test_what_was_written_later_stands_beside_the_rest(tmp_path):
    one = Judged(1.0, 1.0, {"a": np.ones(2)})
    write_judged(tmp_path, {"early": one})
    write_judged(tmp_path, {"late": one})
    assert set(read_judged(tmp_path)) == {"early", "late"}


def test_an_empty_folder_holds_no_detector(tmp_path):
    assert read_judged(tmp_path) == {}


def test_the_fixed_threshold_is_three_sigmas_above_the_mean_of_all_calibration_scores():
    late = np.concatenate([np.full(20, np.nan), alternating(80)])
    data = member([recording("c1"), recording("c2")], [recording("t", 4)])
    judged = judge_scores(CONFIG, data, [alternating(), late], [np.arange(4.0)])
    assert judged.sigma == pytest.approx(2 + 3 * 1)
    assert list(judged.scores) == ["t"]
    np.testing.assert_array_equal(judged.scores["t"], np.arange(4.0))


def test_the_operating_threshold_is_the_score_that_only_ever_lasted_once_too_often():
    scores = alternating()
    scores[40:44] = 7.0  # lasts for 3 s
    scores[70:72] = 9.0  # doesn't
    judged = judge_scores(CONFIG, member([recording("c")]), [scores], [])
    assert judged.operating == pytest.approx(7.0)


def test_a_score_does_not_last_across_a_gap():
    scores = alternating()
    scores[48:52] = 7.0
    data = member([recording("c", segments=((0, 50), (50, 100)))])
    # 3, 7, 7 before the gap; 7, 7, 1 after it.
    assert judge_scores(CONFIG, data, [scores], []).operating == pytest.approx(3.0)
    whole = member([recording("c")])
    assert judge_scores(CONFIG, whole, [scores], []).operating == pytest.approx(7.0)


def test_scores_without_spread_to_judge_by_are_refused():
    with pytest.raises(OdisarError, match="0 calibration scores cannot set a threshold"):
        judge_scores(CONFIG, member([recording("c")]), [np.full(100, np.nan)], [])


def scored(name, time_s):
    return ScoredRecording(
        name=name,
        info=RecordingInfo("system"),
        intervals=(),
        time_s=np.array(time_s),
        scores={"odisar": np.ones(len(time_s))},
        thresholds={"odisar": 2.0},
        operating_thresholds={"odisar": 3.0},
        first_consequence_s=None,
        horizon_steps=2,
        context_steps=3,
        step_s=1.0,
    )


def test_a_detector_joins_at_the_times_the_others_are_scored_at():
    data = member([], [recording("a", 10, start_s=5.0), recording("b", 10)])
    judged = {
        "alone": Judged(4.0, 6.0, {"a": np.arange(10.0), "b": 100 + np.arange(10.0)}),
    }
    # Of `b` first, with a gap; times of `a` don't begin at 0.
    joined = with_detectors([scored("b", [3.0, 4.0, 8.0]), scored("a", [8.0, 9.0])], data, judged)
    assert [item.name for item in joined] == ["b", "a"]
    np.testing.assert_array_equal(joined[0].scores["alone"], [103, 104, 108])
    np.testing.assert_array_equal(joined[1].scores["alone"], [3, 4])
    assert joined[0].detectors == ("odisar", "alone")
    assert joined[0].thresholds == {"odisar": 2.0, "alone": 4.0}
    assert joined[0].operating_thresholds == {"odisar": 3.0, "alone": 6.0}
