import numpy as np
import pytest

from odisar.errors import OdisarError
from odisar.recordings.faults import inject_faults
from odisar.recordings.schema import label_times

FAULTS = {
    "kinds": ["noise", "bias", "drift", "stuck", "delay"],
    "channels": ["Speed"],
    "sizes": {"noise": [2.0], "bias": [2.0], "drift": [2.0]},
    "sizes_in": "sd",
    "delays_s": [3.0],
    "creep": None,
    "start_s": 10.0,
    "duration_s": {"low": 20.0, "high": 20.0},
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
        fault = f"{copy.info.disturbance} {copy.info.column('fault_size')}".strip()
        assert copy.info.extra["fault"] == fault
        assert copy.info.extra["fault_on"] == f"{fault}, Speed"


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


def test_sizes_in_the_channel_s_unit_take_no_account_of_its_spread(make_case, make_recording):
    recording = make_recording("turn", 60)
    case = make_case(faults=FAULTS | {"sizes_in": "unit"})
    faulty = {copy.info.disturbance: copy for copy in inject_faults([recording], case, STD, 7)}
    at = np.flatnonzero(label_times(recording.time_s, faulty["bias"].intervals))
    np.testing.assert_allclose(faulty["bias"].values[at, 1] - recording.values[at, 1], 2.0)
    at = np.flatnonzero(label_times(recording.time_s, faulty["drift"].intervals))
    shown = faulty["drift"].values[at, 1] - recording.values[at, 1]
    np.testing.assert_allclose(shown, np.linspace(0, 2, 20), atol=1e-12)
    at = np.flatnonzero(label_times(recording.time_s, faulty["noise"].intervals))
    assert 1.0 < np.std(faulty["noise"].values[at, 1] - recording.values[at, 1]) < 3.2
    sizes = {kind: copy.info.column("fault_size") for kind, copy in faulty.items()}
    assert sizes == {
        "noise": "2 m/s",
        "bias": "2 m/s",
        "drift": "2 m/s",
        "stuck": "",
        "delay": "3 s",
    }


def test_creep_grows_at_its_rate_from_its_start(make_case, make_recording):
    recording = make_recording("turn", 60)
    creep = {"channels": ["Speed"], "rates": [0.03, 0.1]}
    case = make_case(faults=FAULTS | {"kinds": [], "creep": creep})
    slow, fast = inject_faults([recording], case, STD, 7)
    for copy, rate, size in ((slow, 0.03, "0.03 m/s/s"), (fast, 0.1, "0.1 m/s/s")):
        inside = label_times(recording.time_s, copy.intervals)
        grown = copy.values[inside, 1] - recording.values[inside, 1]
        np.testing.assert_allclose(grown, rate * np.arange(20), atol=1e-12)
        np.testing.assert_array_equal(copy.values[~inside], recording.values[~inside])
        assert (copy.info.disturbance, copy.info.column("fault_size")) == ("creep", size)
    assert len({slow.name, fast.name}) == 2


def test_a_channel_that_creeps_must_exist(make_case):
    creep = {"channels": ["Sped"], "rates": [0.03]}
    with pytest.raises(ValueError, match="Sped"):
        make_case(faults=FAULTS | {"creep": creep})


def test_whether_a_fault_shows_is_judged_in_standard_deviations(make_case, make_recording):
    faults = FAULTS | {"kinds": ["bias"], "sizes_in": "unit", "shows_from_sd": 3.0}
    for size, shows in ((1.4, "hidden"), (1.6, "shows")):
        case = make_case(faults=faults | {"sizes": {"bias": [size]}})
        (copy,) = inject_faults([make_recording("turn", 60)], case, STD, 7)
        assert copy.info.column("fault_shows") == shows


def test_kinds_have_sizes_of_their_own(make_case, make_recording):
    sizes = {"noise": [1.0, 2.0], "bias": [3.0], "drift": [4.0]}
    case = make_case(faults=FAULTS | {"kinds": ["noise", "bias", "drift"], "sizes": sizes})
    faulty = inject_faults([make_recording("turn", 60)], case, STD, 7)
    found = [(copy.info.disturbance, copy.info.column("fault_size")) for copy in faulty]
    assert found == [("noise", "1 sd"), ("noise", "2 sd"), ("bias", "3 sd"), ("drift", "4 sd")]


def test_durations_are_drawn_between_the_two_and_by_name_alone(make_case, make_recording):
    case = make_case(faults=FAULTS | {"duration_s": {"low": 5.0, "high": 15.0}})
    recordings = [make_recording(name, 60) for name in "abcdefgh"]
    lengths = {}
    for copy in inject_faults(recordings, case, STD, 7):
        (interval,) = copy.intervals
        lengths[copy.name] = interval.end_s - interval.start_s
        assert interval.start_s >= 10.0
        assert interval.end_s <= 60.0
    drawn = np.array(list(lengths.values()))
    assert drawn.min() >= 5.0
    assert drawn.max() <= 15.0
    assert drawn.max() - drawn.min() > 5.0
    assert len(np.unique(drawn)) == len(drawn)
    for copy in inject_faults(recordings[3:4], case, STD, 7):
        (interval,) = copy.intervals
        assert interval.end_s - interval.start_s == lengths[copy.name]


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
        ({"duration_s": {"low": 20.0, "high": 51.0}}, r"61 s .* turn \(60 s\)"),
        ({"duration_s": {"low": 0.5, "high": 20.0}}, "shorter than one sample"),
        ({"delays_s": [11.0]}, "delays_s=11 reaches back before the recording"),
        ({"sizes": FAULTS["sizes"] | {"noise": [2.0, 2.0]}}, "noise-speed-2.0 would be made twice"),
    ],
)
def test_faults_that_cannot_be_injected(make_case, make_recording, changes, message):
    case = make_case(faults=FAULTS | changes)
    with pytest.raises(OdisarError, match=message):
        inject_faults([make_recording("turn", 60)], case, STD, 7)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"duration_s": {"low": 20.0, "high": 10.0}}, r"low=20\.0 is above high=10\.0"),
        ({"sizes": {"noise": [2.0], "drift": [2.0]}}, "bias is among kinds but has no size"),
        ({"delays_s": []}, "delay is among kinds but has no size"),
        ({"sizes_in": "percent"}, "sizes_in"),
    ],
)
def test_faults_that_are_no_configuration(make_case, changes, message):
    with pytest.raises(ValueError, match=message):
        make_case(faults=FAULTS | changes)
