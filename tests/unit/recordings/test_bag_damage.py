"""Bags that are cut off, damaged, incomplete, compressed or too large."""

import contextlib
import shutil
import sqlite3

import numpy as np
import pyarrow as pa
import pytest
from backports import zstd
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Writer, storage_mcap

from odisar.recordings import file_checks

SAMPLES = 30
BROKEN_YAML = "rosbag2_bagfile_information: [1, {\n"


@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.9, 0.999])
def test_a_bag_that_is_cut_off(bag_boat, ros, messages, storage, share):
    path = ros.write(bag_boat.folder / "a", messages, storage)
    (file,) = [entry for entry in path.iterdir() if entry.suffix != ".yaml"]
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    finding = bag_boat.one(f"{file.name} is cut off or damaged")
    assert (finding.severity, finding.file) == ("error", "boat/a")
    assert "ros2 bag reindex" in finding.remedy
    assert str(bag_boat.root) not in finding.value
    shutil.move(file, bag_boat.folder / f"b{file.suffix}")
    shutil.rmtree(path)
    assert bag_boat.one("is cut off or damaged").file == f"boat/b{file.suffix}"


def test_damage_in_the_middle_names_the_file_and_if_known_the_message(
    bag_boat, ros, messages, storage
):
    many = [ros.odometry(i, np.cos(i)) for i in range(SAMPLES, 3000)]
    path = ros.write(bag_boat.folder / "a", messages + many, storage)
    (file,) = [entry for entry in path.iterdir() if entry.suffix != ".yaml"]
    raw = bytearray(file.read_bytes())
    middle = len(raw) // 2 // 4096 * 4096
    raw[middle : middle + 3 * 4096] = b"\xff" * (3 * 4096)
    file.write_bytes(raw)
    finding = bag_boat.one(f"{file.name} is cut off or damaged")
    assert (finding.row or 0) > 1000 if storage == "mcap" else finding.row is None
    assert bag_boat.read().recordings == []


def test_a_bag_without_metadata(bag_boat, ros, messages, storage):
    path = ros.write(bag_boat.folder / "a", messages, storage)
    (path / "metadata.yaml").unlink()
    finding = bag_boat.one("the bag has no metadata.yaml")
    assert "ros2 bag reindex" in finding.remedy
    assert "out of its folder" in finding.remedy


@pytest.mark.parametrize(
    "text",
    ["", BROKEN_YAML, "a: 1\n", "[1, 2]\n", "\xff\xfe", "rosbag2_bagfile_information: {}\n"],
)
def test_metadata_that_cannot_be_used(bag_boat, ros, messages, storage, text):
    path = ros.write(bag_boat.folder / "a", messages, storage)
    (path / "metadata.yaml").write_bytes(text.encode("latin-1"))
    found = bag_boat.one("the bag does not fit its metadata.yaml")
    assert "ros2 bag reindex" in found.remedy


def test_metadata_that_names_files_that_are_not_there(bag_boat, ros, messages):
    path = ros.write(bag_boat.folder / "a", messages)
    (path / "a.mcap").rename(path / "b.mcap")
    finding = bag_boat.one("does not fit its metadata.yaml")
    assert "a.mcap" in finding.value
    assert bag_boat.one("does not list is not read").value == "b.mcap"


@pytest.mark.parametrize(
    ("counted", "severity", "problem", "value"),
    [
        (31, "error", "messages that the bag's metadata counts are missing", "1 of 31"),
        (29, "warning", "the bag's metadata counts fewer messages than there are", "29 of 30"),
    ],
)
def test_metadata_that_counts_other_messages(
    bag_boat, ros, messages, counted, severity, problem, value
):
    path = ros.write(bag_boat.folder / "a", messages)
    text = (path / "metadata.yaml").read_text()
    (path / "metadata.yaml").write_text(
        text.replace("message_count: 30", f"message_count: {counted}")
    )
    found = bag_boat.found(problem)
    assert {(finding.severity, finding.value) for finding in found} == {(severity, value)}
    assert {finding.column for finding in found} == {"/odom", "/rudder", "/joint_states"}
    assert len(bag_boat.read().recordings) == (severity == "warning")


def test_messages_left_in_a_journal(bag_boat, ros, messages):
    path = ros.write(bag_boat.folder / "a", messages, "sqlite")
    (path / "a.db3-wal").write_bytes(b"frames")
    finding = bag_boat.one("messages lie in a journal")
    assert finding.value == "a.db3-wal"
    assert "wal_checkpoint" in finding.remedy


def test_a_bag_without_definitions_is_read_with_those_of_humble(bag_boat, ros, messages):
    path = ros.write(bag_boat.folder / "a", messages, "sqlite")
    with contextlib.closing(sqlite3.connect(path / "a.db3")) as database:
        database.executescript("DROP TABLE schema; DROP TABLE message_definitions;")
    result = bag_boat.read()
    assert result.findings == []
    assert result.recordings[0].values.shape == (SAMPLES, 3)


@pytest.mark.parametrize("mode", ["FILE", "MESSAGE"])
def test_a_compressed_bag(bag_boat, ros, messages, storage, mode):
    path = bag_boat.folder / "a"
    writer = Writer(path, version=9, storage_plugin=ros.storage(storage))
    writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    ros.fill(writer, messages)
    result = bag_boat.read()
    assert result.findings == []
    assert result.recordings[0].values.shape == (SAMPLES, 3)
    for file in path.glob("*.zstd"):
        file.write_bytes(file.read_bytes()[:1000])
        assert bag_boat.one(f"{file.name} is cut off or damaged").severity == "error"


def test_a_path_that_sqlite_cannot_open(bag_boat, ros, messages):
    ros.write(bag_boat.folder / "a", messages, "sqlite").rename(bag_boat.folder / "run#1")
    assert "rename" in bag_boat.one("in its path").remedy


def test_more_than_the_size_limit_is_not_read(bag_boat, ros, messages, storage, monkeypatch):
    ros.write(bag_boat.folder / "a", messages, storage)
    monkeypatch.setattr(file_checks, "MAX_FILE_BYTES", 10_000)
    finding = bag_boat.one("part of the bag that is read is larger than the limit")
    assert 1 < finding.row < SAMPLES


def test_other_topics_do_not_count_for_the_size_limit(bag_boat, ros, messages, monkeypatch):
    image = ("/camera", "std_msgs/msg/String", ros.ns(0.5), b"\x00\x01\x00\x00" + bytes(100_000))
    ros.write(bag_boat.folder / "a", [*messages, image])
    monkeypatch.setattr(file_checks, "MAX_FILE_BYTES", 80_000)
    assert bag_boat.read().findings == []


def test_a_bag_of_ros_1(bag_boat):
    bag_boat.good("b.csv")
    bag_boat.write("a.bag", b"#ROSBAG V2.0\n")
    finding = bag_boat.one("a ROS 1 bag: it is not read")
    assert (finding.severity, finding.value) == ("warning", "a.bag")
    assert "rosbags-convert --src a.bag --dst a" in finding.remedy


def test_a_folder_of_recordings_that_is_a_bag_itself(bag_boat, ros, messages, tmp_path):
    path = ros.write(tmp_path / "a", messages)
    for entry in path.iterdir():
        shutil.move(entry, bag_boat.folder / entry.name)
    assert "a folder that holds it" in bag_boat.one("is itself a ROS 2 bag").remedy


@pytest.mark.parametrize("stamp", ["header", "received"])
@pytest.mark.parametrize(("written", "value"), [("abc", "'abc'"), (9.3e18, "9.3e+18"), (-5, "-5")])
def test_a_time_of_arrival_that_is_no_whole_number(boat_with, ros, messages, stamp, written, value):
    boat = boat_with(stamp=stamp)
    path = ros.write(boat.folder / "a", messages, "sqlite")
    with contextlib.closing(sqlite3.connect(path / "a.db3")) as database, database:
        database.execute("DROP INDEX timestamp_idx")
        database.execute("UPDATE messages SET timestamp = ? WHERE id = 10", [written])
    finding = boat.one("the time of arrival is no whole number of nanoseconds")
    assert (finding.severity, finding.value) == ("error", value)
    assert finding.row == (1 if written == -5 else SAMPLES)
    assert boat.read().recordings == []


def test_a_time_of_arrival_that_is_null(bag_boat, ros, messages):
    path = ros.write(bag_boat.folder / "a", messages, "sqlite")
    with contextlib.closing(sqlite3.connect(path / "a.db3")) as database, database:
        database.execute("CREATE TABLE copied AS SELECT * FROM messages")
        database.execute("DROP TABLE messages")
        database.execute("ALTER TABLE copied RENAME TO messages")
        database.execute("UPDATE messages SET timestamp = NULL WHERE id = 10")
    assert bag_boat.one("the time of arrival is no whole number").value == "None"


@pytest.mark.parametrize("mode", ["FILE", "MESSAGE"])
def test_a_bag_that_is_larger_than_the_limit_once_it_is_decompressed(
    bag_boat, ros, messages, mode, monkeypatch
):
    monkeypatch.setattr(file_checks, "MAX_FILE_BYTES", 3_000_000)
    zeros = b"\x00\x01\x00\x00" + bytes(40_000_000)
    bomb = ("/odom", "nav_msgs/msg/Odometry", ros.ns(31), zeros)
    writer = Writer(bag_boat.folder / "a", version=9, storage_plugin=ros.storage("mcap"))
    writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    ros.fill(writer, [*messages, bomb])
    unpack = zstd.ZstdFile if mode == "FILE" else zstd
    name = "readinto" if mode == "FILE" else "decompress"
    monkeypatch.setattr(unpack, name, lambda *_: pytest.fail("decompressed without a limit"))
    what = "decompressed bag" if mode == "FILE" else "part of the bag that is read"
    finding = bag_boat.one(f"the {what} is larger than the limit")
    assert finding.value in ("3 MiB", "4 MiB")


def test_a_chunk_that_is_larger_than_it_states_is_not_decompressed(
    bag_boat, ros, messages, monkeypatch
):
    """rosbags would first decompress all of it and then compare."""
    zeros = b"\x00\x01\x00\x00" + bytes(40_000_000)
    large = ("/odom", "nav_msgs/msg/Odometry", ros.ns(31), zeros)
    writer = Writer(bag_boat.folder / "a", version=9, storage_plugin=ros.storage("mcap"))
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    ros.fill(writer, [*messages, large])
    assert bag_boat.one("the message cannot be decoded").row == SAMPLES + 1
    monkeypatch.setattr(file_checks, "MAX_FILE_BYTES", 3_000_000)
    monkeypatch.setattr(zstd, "decompress", lambda *_: pytest.fail("without a limit"))
    assert "larger than the limit of a file" in bag_boat.one("is cut off or damaged").value


@pytest.mark.parametrize("codec", ["lz4", "zstd"])
def test_a_chunk_is_decompressed_to_one_byte_more_than_it_states_at_most(codec):
    raw = bytes(range(256)) * 20_000
    packed = pa.compress(raw, codec=codec, asbytes=True)
    unpack = storage_mcap.DECOMPRESSORS[codec]
    assert unpack(packed, len(raw)) == raw
    assert unpack(packed, 1000) == raw[:1001]


@pytest.mark.parametrize("suffix", [".MCAP", ".Db3"])
def test_a_file_of_messages_whose_name_does_not_end_in_lower_case(bag_boat, suffix):
    bag_boat.write(f"b{suffix}", b"anything")
    finding = bag_boat.one("not in lower case")
    assert finding.remedy == f"rename it to lower case: b{suffix.lower()}"


@pytest.mark.parametrize(("old", "new"), [(b"ros2", b"ros1"), (b"ros2msg", b"ros1msg")])
def test_an_mcap_file_of_another_system(bag_boat, ros, messages, tmp_path, old, new):
    path = ros.write(tmp_path / "b", messages) / "b.mcap"
    raw = path.read_bytes()
    count = 1 if old == b"ros2" else -1
    bag_boat.write("b.mcap", raw.replace(old, new, count))
    finding = bag_boat.one("not a ROS 2 bag")
    assert finding.remedy.startswith("convert it")
