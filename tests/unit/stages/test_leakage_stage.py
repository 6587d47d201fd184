"""Every detector of a member is really asked again, on short recordings that still say enough."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from odisar.stages.leakage import member_leakage, probed_recordings
from odisar.stages.members import MemberData
from odisar.windows.coordinates import PoseChannels
from odisar.windows.scaling import Scaler
from small_bundle import small_case
from small_system import SPEC, make_recording

#: Context 20, three horizons of 10, and 20 more.
PROBED_SAMPLES = 70


def member(*calibration):
    train = [make_recording(f"train-{i}", 100) for i in range(2)]
    splits = {"train": train, "calibration": list(calibration)}
    return MemberData(small_case(), splits, Scaler.fit(train, SPEC), SPEC)


class Detectors:
    """Detectors that share what they are asked, as those of a member do."""

    def __init__(self, *names):
        self._names = names
        self._asked = {}
        self.times_asked = 0

    def score(self, recording):
        """Return scores of all samples that have a context."""
        self.times_asked += 1
        key = recording.values.tobytes()
        self._asked[key] = self._asked.get(key, 0) + 1
        speed = recording.values[:, 1]
        every = {
            "steady": np.exp(speed),
            "weary": np.exp(speed) + self._asked[key],
            "seer": np.exp(np.append(speed[1:], 0.0)),
            "constant": np.ones(len(speed)),
        }
        positions = np.arange(SPEC.context_steps - 1, len(speed))
        return SimpleNamespace(positions=positions), {
            name: every[name][positions] for name in self._names
        }


@pytest.fixture
def data():
    return member(*(make_recording(f"calibration-{i}") for i in range(3)))


def moved(table, detector):
    """Return by probe how many changes moved the score, and the number of changes."""
    own = table[table.detector == detector].set_index("probe")
    return own.moved.to_dict(), own.positions.to_dict()


@pytest.mark.parametrize("names", [("steady", "weary"), ("weary", "steady")])
def test_a_detector_that_answers_otherwise_when_asked_again_is_caught(data, names):
    table = member_leakage(data, Detectors(*names), 3)
    assert table.detector.unique().tolist() == list(names)
    weary, tried = moved(table, "weary")
    assert weary["repeat"] == tried["repeat"] == 2
    steady, tried = moved(table, "steady")
    assert {probe: n for probe, n in steady.items() if n} == {"control": tried["control"]}


def test_one_that_sees_the_next_sample_and_one_that_sees_nothing_are_caught(data):
    table = member_leakage(data, Detectors("steady", "seer", "constant"), 3)
    seer, _ = moved(table, "seer")
    assert seer["future"] > 0
    assert seer["truncation"] > 0
    assert seer["repeat"] == seer["labels"] == seer["batch"] == 0
    constant, _ = moved(table, "constant")
    assert set(constant.values()) == {0}


def test_more_detectors_need_no_more_scoring(data):
    one, three = Detectors("steady"), Detectors("steady", "seer", "constant")
    member_leakage(data, one, 3)
    member_leakage(data, three, 3)
    assert three.times_asked == one.times_asked


def test_only_the_beginnings_of_two_recordings_are_probed(data):
    probed = probed_recordings(data)
    assert [item.name for item in probed] == ["calibration-0", "calibration-1"]
    for item, whole in zip(probed, data.splits["calibration"], strict=False):
        np.testing.assert_array_equal(item.values, whole.values[:PROBED_SAMPLES])
        np.testing.assert_array_equal(item.time_s, whole.time_s[:PROBED_SAMPLES])
        assert item.segments == ((0, PROBED_SAMPLES),)
        assert len(whole.time_s) == 300


@pytest.mark.parametrize(
    ("segments", "kept"),
    [
        (((0, 40), (45, 300)), ((0, 40), (45, 70))),
        (((0, 70), (80, 300)), ((0, 70),)),
        (((5, 300),), ((5, 70),)),
        (((0, 40), (70, 300)), ((0, 40),)),
    ],
)
def test_segments_end_where_the_samples_do(segments, kept):
    item = replace(make_recording("gaps"), segments=segments)
    (probed,) = probed_recordings(member(item))
    assert probed.segments == kept
    assert len(probed.values) == len(probed.time_s) == PROBED_SAMPLES


def test_a_recording_that_is_shorter_is_taken_whole():
    (probed,) = probed_recordings(member(make_recording("short", 60)))
    assert probed.segments == ((0, 60),)
    assert len(probed.values) == 60


def test_a_sample_without_a_rate_is_not_counted_as_context(data):
    pose = PoseChannels(x=1, y=2, heading=(0,), in_degrees=False)
    relative = replace(data, spec=replace(SPEC, pose=pose, commands=()))
    assert len(probed_recordings(relative)[0].time_s) == PROBED_SAMPLES + 1
