"""Samples of a bag: their times, and what other topics said last."""

import shutil

import numpy as np
import pytest

START_NS = 1_700_000_000_000_000_000
SAMPLES = 30


def without(messages, topic):
    return [message for message in messages if message[0] != topic]


def test_a_bag_says_when_it_started(bag_boat, ros, messages):
    ros.write(bag_boat.folder / "a", messages)
    (recording,) = bag_boat.read().recordings
    assert recording.info.extra == {"started_at": "1700000000.000000000"}


def test_the_index_keeps_the_start_beside_its_own_columns(bag_boat, ros, messages):
    ros.write(bag_boat.folder / "a", messages)
    bag_boat.write("recordings.csv", "recording,sea\na,calm\n")
    (recording,) = bag_boat.read().recordings
    assert recording.info.extra == {"started_at": "1700000000.000000000", "sea": "calm"}


@pytest.mark.parametrize("suffix", [".mcap", ".db3"])
def test_a_file_of_messages_without_its_folder(bag_boat, ros, messages, suffix, tmp_path):
    ros.write(bag_boat.folder / "a", messages)
    ros.write(tmp_path / "b", messages, "mcap" if suffix == ".mcap" else "sqlite")
    shutil.move(tmp_path / "b" / f"b{suffix}", bag_boat.folder / f"b{suffix}")
    result = bag_boat.read()
    assert result.findings == []
    first, second = result.recordings
    assert [first.name, second.name] == ["a", "b"]
    np.testing.assert_array_equal(first.values, second.values)


def test_times_of_arrival_instead_of_headers(boat_with, ros, messages):
    boat = boat_with(stamp="received")
    arrivals = [
        (topic, kind, START_NS + 7 + 10**9 * (i // 3), message)
        for i, (topic, kind, _, message) in enumerate(messages)
    ]
    ros.write(boat.folder / "a", arrivals)
    (recording,) = boat.read().recordings
    np.testing.assert_array_equal(recording.time_s, np.arange(SAMPLES))
    assert recording.info.extra["started_at"] == "1700000000.000000007"


def test_messages_stored_out_of_the_order_of_their_headers(bag_boat, ros, messages):
    """What another topic said is found by its stamp, wherever the bag has it."""
    ros.write(bag_boat.folder / "a", messages)
    late = [
        (topic, kind, arrival_ns + (5 * 10**9 if topic == "/joint_states" else 0), message)
        for topic, kind, arrival_ns, message in messages
    ]
    ros.write(bag_boat.folder / "b", late)
    result = bag_boat.read()
    assert result.findings == []
    np.testing.assert_array_equal(result.recordings[0].values, result.recordings[1].values)


def test_another_topic_gives_its_last_value_and_never_a_later_one(bag_boat, ros, messages):
    joints = [ros.joints(i / 4, [0.0, i / 100]) for i in range(-1, 4 * SAMPLES)]
    ros.write(bag_boat.folder / "a", without(messages, "/joint_states") + joints)
    (recording,) = bag_boat.read().recordings
    np.testing.assert_array_equal(recording.values[:, 2], [4 * i / 100 for i in range(SAMPLES)])
    joints = [ros.joints(i + 0.001, [0.0, i / 100]) for i in range(-1, SAMPLES)]
    ros.write(bag_boat.folder / "b", without(messages, "/joint_states") + joints)
    recording = bag_boat.read().recordings[1]
    np.testing.assert_array_equal(recording.values[:, 2], [(i - 1) / 100 for i in range(SAMPLES)])


def test_a_value_that_is_too_old(boat_with, ros, messages):
    boat = boat_with(max_age_s=1.0)
    late = [ros.joints(9 + 0.9, [0.0, 0.1])]
    kept = [m for i, m in enumerate(messages) if m[0] != "/joint_states" or i // 3 not in (12, 13)]
    ros.write(boat.folder / "a", kept + late)
    found = boat.found("older than max_age_s=1")
    assert [(found.column, found.row, found.value) for found in found] == [
        ("/joint_states", 13, "1.1"),
        ("/joint_states", 14, "2.1"),
    ]
    assert "raise source.bag.max_age_s" in found[0].remedy


def test_samples_before_another_topic_speaks_are_left_out_with_a_warning(bag_boat, ros, messages):
    late = [m for m in messages if m[0] != "/rudder" or m[2] > ros.ns(4.5)]
    ros.write(bag_boat.folder / "a", late)
    finding = bag_boat.one("samples before the first message of /rudder are left out")
    assert (finding.severity, finding.value) == ("warning", "5 samples")
    (recording,) = bag_boat.read().recordings
    assert len(recording.time_s) == SAMPLES - 5
    assert recording.time_s[0] == 0.0
    assert recording.info.extra["started_at"] == "1700000005.000000000"


def test_rows_count_messages_of_the_stamp_topic_also_after_a_late_start(bag_boat, ros, messages):
    late = [m for m in messages if m[0] != "/rudder" or m[2] > ros.ns(4.5)]
    odometry = ros.odometry(10, 99.0)
    late = [odometry if m[0] == "/odom" and m[2] == odometry[2] else m for m in late]
    ros.write(bag_boat.folder / "a", late)
    assert bag_boat.one("outside -15 to 15").row == 11


def test_clocks_that_have_nothing_to_do_with_each_other(bag_boat, ros, messages):
    days = 86_400 * 10**9
    ahead = [(*m[:2], m[2] + (days if m[0] == "/rudder" else 0), m[3]) for m in messages]
    ros.write(bag_boat.folder / "a", ahead)
    finding = bag_boat.one("no message comes before the last sample")
    assert finding.column == "/rudder"
    assert "one clock" in finding.remedy


def test_headers_that_are_never_filled_in(bag_boat, ros, messages):
    zeros = [ros.odometry(i, 5 + i / 10, stamp_ns=0) for i in range(SAMPLES)]
    ros.write(bag_boat.folder / "a", without(messages, "/odom") + zeros)
    finding = bag_boat.one("the stamp of every header is 0")
    assert finding.column == "/odom"
    assert finding.remedy.startswith("set source.bag.stamp: received")
    assert bag_boat.read().findings == [finding]


def test_a_clock_that_jumps_back_is_named_by_its_message(bag_boat, ros, messages):
    jumped = [
        ros.odometry(i - (5 if i >= 20 else 0), 5 + np.cos(i), arrival_s=i + 0.05)
        for i in range(SAMPLES)
    ]
    ros.write(bag_boat.folder / "a", without(messages, "/odom") + jumped)
    finding = bag_boat.one("the time goes back")
    assert (finding.row, finding.value) == (21, "15")
    assert "source.bag.stamp: received" in finding.remedy


def test_a_clock_that_jumps_back_in_another_topic_is_named_by_its_message(bag_boat, ros, messages):
    """Sorted by stamps, what that topic said later would be known to earlier samples."""
    jumped = [
        (*ros.joints(i - (5 if i >= 20 else 0) - 0.1, [0.0, i / 100])[:2], ros.ns(i - 0.08),
         ros.joints(i - (5 if i >= 20 else 0) - 0.1, [0.0, i / 100])[3])
        for i in range(SAMPLES)
    ]  # fmt: skip
    ros.write(bag_boat.folder / "a", without(messages, "/joint_states") + jumped)
    finding = bag_boat.one("the time goes back")
    assert (finding.severity, finding.column, finding.row) == ("error", "/joint_states", 21)
    assert "source.bag.stamp: received" in finding.remedy


@pytest.mark.parametrize("blank", [0, 7])
def test_one_header_that_is_not_filled_in(bag_boat, ros, messages, blank):
    spoiled = [
        ros.odometry(i, 5 + i / 10, stamp_ns=0 if i == blank else None) for i in range(SAMPLES)
    ]
    ros.write(bag_boat.folder / "a", without(messages, "/odom") + spoiled)
    finding = bag_boat.one("the stamp of the header is 0")
    assert (finding.severity, finding.column, finding.row) == ("error", "/odom", blank + 1)
    assert finding.remedy == "set source.bag.stamp: received, or trim the first messages"
    assert bag_boat.read().findings == [finding]
