import numpy as np
import pytest

from odisar.errors import OdisarError
from odisar.recordings.faults import inject_faults
from odisar.recordings.schema import label_times

FAULTS = {
    "kinds": ["noise", "bias", "drift", "stuck", "delay"],
    "channels": ["Speed"],
    "sizes": [2.0],
    "delays_s": [3.0],
    "start_s": 10.0,
    "duration_s": 20.0,
    "shows_from_sd": 0.25,
}
STD = np.array([1.0, 0.5, 2.0])


@pytest.fixture
def copies(make_case, make_recording):
    recording = make_recording("turn", 60, maneuver="turning", split="test")
    faulty = inject_faults([recording], make_case(faults=FAULTS), STD, 7)
    return recording, {copy.info.disturbance: copy for copy in faulty}


def test_each_fault_gives_a_copy_that_says_what_it_is(copies):
    _, faulty = copies
    assert {kind: copy.name for kind, copy in faulty.items()} == {
        "noise": "turn-noise-speed-2.0",
        "bias": "turn-bias-speed-2.0",
        "drift": "turn-drift-speed-2.0",
        "stuck": "turn-stuck-speed",
        "delay": "turn-delay-speed-3.0",
    }
    sizes = {kind: copy.info.column("fault_size") for kind, copy in faulty.items()}
    assert sizes == {"noise": "2 sd", "bias": "2 sd", "drift": "2 sd", "stuck": "", "delay": "3 s"}
    for copy in faulty.values():
        assert copy.info.components == "all"
        assert copy.info.base_seed == "turn"
        assert copy.info.maneuver == "turning"
        assert copy.info.split == "test"
        assert copy.info.extra["fault_channel"] == "Speed"


def test_the_interval_fits_and_outside_it_nothing_changes(copies):
    recording, faulty = copies
    for kind, copy in faulty.items():
        (interval,) = copy.intervals
        assert interval.label == kind
        assert 10.0 <= interval.start_s <= 40.0
        assert interval.end_s == interval.start_s + 20.0
        inside = label_times(copy.time_s, copy.intervals)
        assert inside.sum() == 20
        np.testing.assert_array_equal(copy.values[~inside], recording.values[~inside])
        np.testing.assert_array_equal(copy.values[:, [0, 2]], recording.values[:, [0, 2]])


def test_what_the_faulty_sensor_shows(copies):
    recording, faulty = copies

    def shown(kind):
        inside = label_times(recording.time_s, faulty[kind].intervals)
        return faulty[kind].values[inside, 1], recording.values[:, 1], np.flatnonzero(inside)

    values, truth, at = shown("bias")
    np.testing.assert_allclose(values - truth[at], 1.0)
    values, truth, at = shown("drift")
    np.testing.assert_allclose(values - truth[at], np.linspace(0, 1, 20), atol=1e-12)
    values, truth, at = shown("stuck")
    assert set(values) == {truth[at[0] - 1]}
    values, truth, at = shown("delay")
    np.testing.assert_array_equal(values, truth[at - 3])
    values, truth, at = shown("noise")
    assert 0.5 < np.std(values - truth[at]) < 1.6
    assert len(np.unique(values - truth[at])) == 20


def test_the_seed_alone_decides(make_case, make_recording):
    recordings = [make_recording("a", 60), make_recording("b", 60)]
    case = make_case(faults=FAULTS)
    both = inject_faults(recordings, case, STD, 7)
    alone = inject_faults(recordings[1:], case, STD, 7)
    for left, right in zip(both[5:], alone, strict=True):
        np.testing.assert_array_equal(left.values, right.values)
    other = inject_faults(recordings[1:], case, STD, 8)
    assert [copy.intervals for copy in other] != [copy.intervals for copy in alone]


def test_a_fault_does_not_lie_across_a_gap(make_case, make_recording):
    recording = make_recording("a", 60, ((0, 25), (25, 60)))
    for seed in range(20):
        for copy in inject_faults([recording], make_case(faults=FAULTS), STD, seed):
            assert label_times(copy.time_s, copy.intervals).sum() == 20


def test_disturbed_recordings_and_cases_without_faults_give_no_copies(make_case, make_recording):
    disturbed = make_recording("a", disturbance="wind")
    assert inject_faults([disturbed], make_case(faults=FAULTS), STD, 7) == []
    assert inject_faults([make_recording("a")], make_case(), STD, 7) == []


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"duration_s": 51.0}, r"61 s .* turn \(60 s\)"),
        ({"duration_s": 0.5}, "shorter than one sample"),
        ({"delays_s": [11.0]}, "delays_s=11 reaches back before the recording"),
        ({"sizes": [2.0, 2.0]}, "noise-speed-2.0 would be made twice"),
    ],
)
def test_faults_that_cannot_be_injected(make_case, make_recording, changes, message):
    case = make_case(faults=FAULTS | changes)
    with pytest.raises(OdisarError, match=message):
        inject_faults([make_recording("turn", 60)], case, STD, 7)
