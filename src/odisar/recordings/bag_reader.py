"""Read one ROS 2 bag into numbers: a sample for each message of one topic."""

from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa  # type: ignore[import-untyped]
from rosbags.interfaces import Connection, TopicInfo
from rosbags.rosbag2 import Reader

from odisar.config.cases import Case
from odisar.config.formats import BagFormat
from odisar.recordings.bag_fields import FieldFaultError, split_path
from odisar.recordings.bag_samples import make_samples
from odisar.recordings.bag_topic import TopicReader
from odisar.recordings.file_checks import check_size, note_unreadable
from odisar.recordings.folder import BAG_METADATA, bag_files
from odisar.recordings.quality import Notes
from odisar.recordings.table import Table, closest, listed

_REINDEX = "run `ros2 bag reindex` on it, or record again"
_CHUNK_BYTES = 1024**2
_REPAIR = (
    "copy or record it again, or repair it (sqlite3 .recover, mcap recover; then "
    "`ros2 bag reindex`)"
)


def read_bag(path: Path, case: Case, notes: Notes) -> Table | None:
    """Return time and channels at each message of ``source.bag.stamp_topic``, or None.

    ``path`` is the folder of a bag, or a file of messages (SQLite or MCAP) by itself. Messages
    are numbered from 1, as the bag gives them. Everything wrong goes to ``notes``.
    """
    if not _is_complete(path, notes):
        return None
    try:
        reader = Reader(path)
        reader.open()
    except Exception as fault:  # noqa: BLE001 - a damaged bag makes rosbags raise anything
        _note_damage(path, fault, None, notes)
        return None
    try:
        return _read(reader, path, case, notes)
    finally:
        reader.close()


def _is_complete(path: Path, notes: Notes) -> bool:
    """Return whether a bag has its metadata and no messages outside of its files."""
    try:
        if path.is_dir():
            return _is_complete_folder(path, notes)
        size = path.stat().st_size
    except OSError as fault:
        note_unreadable(fault, notes)
        return False
    if not size:
        notes.error("the file is empty", "record it again, or remove it")
        return False
    return _is_finished(path, notes)


def _is_complete_folder(path: Path, notes: Notes) -> bool:
    files = bag_files(path)
    metadata = path / BAG_METADATA
    if not metadata.exists():
        alone = f", or move {files[0].name} out of its folder" if len(files) == 1 else ""
        notes.error(f"the bag has no {BAG_METADATA}", f"{_REINDEX}{alone}")
        return False
    text = metadata.read_text(encoding="utf-8", errors="replace")
    for file in files:
        if file.name not in text:
            problem = f"a file that {BAG_METADATA} does not list is not read"
            notes.warning(problem, f"{_REINDEX}, or remove the file", value=file.name)
    unfinished = [file for file in files if not _is_finished(file, notes)]
    return not unfinished


def _is_finished(file: Path, notes: Notes) -> bool:
    """Return whether SQLite can open the file, which is whole and holds all that was recorded."""
    if file.suffix != ".db3":
        return True
    journal = file.with_name(f"{file.name}-wal")
    if set("?#%") & set(str(file)):
        problem = "SQLite cannot open a file with ?, # or % in its path"
        notes.error(problem, "rename the file or its folder", value=file.name)
    elif journal.exists() and journal.stat().st_size:
        notes.error(
            "the recorder did not finish: messages lie in a journal beside the file",
            f"put them into it: sqlite3 {file.name} 'PRAGMA wal_checkpoint(TRUNCATE)'",
            value=journal.name,
        )
    elif file.stat().st_size < _stated_size(file):
        value = f"{file.stat().st_size} of {_stated_size(file)} bytes"
        notes.error(f"{file.name} is cut off or damaged", _REPAIR, value=value)
    else:
        return True
    return False


def _stated_size(file: Path) -> int:
    """Return the size that the header of an SQLite file states, 0 if it states none."""
    with file.open("rb") as opened:
        header = opened.read(100)
    # https://www.sqlite.org/fileformat.html, 1.3: the size counts if both counters are equal.
    if len(header) < 100 or header[24:28] != header[92:96]:
        return 0
    page = int.from_bytes(header[16:18])
    return (65536 if page == 1 else page) * int.from_bytes(header[28:32])


def _note_damage(path: Path, fault: Exception, row: int | None, notes: Notes) -> None:
    """Note why a bag cannot be read (on), and which of its files is to blame."""
    reason = " ".join(str(fault).replace(f"{path.parent}/", "").split()) or type(fault).__name__
    if not path.is_dir():
        notes.error(f"{path.name} is cut off or damaged", _REPAIR, row=row, value=reason)
        return
    damaged = next((file.name for file in bag_files(path) if not _is_readable(file)), None)
    if damaged is None:
        notes.error(f"the bag does not fit its {BAG_METADATA}", _REINDEX, row=row, value=reason)
        return
    notes.error(f"{damaged} is cut off or damaged", _REPAIR, row=row, value=reason)


def _is_readable(file: Path) -> bool:
    try:
        if file.suffix == ".zstd":
            with pa.input_stream(file, compression="zstd") as stream:
                while stream.read(_CHUNK_BYTES):
                    pass
            return True
        with Reader(file) as reader:
            for _ in reader.messages():
                pass
    except Exception:  # noqa: BLE001 - see read_bag
        return False
    return True


def _read(reader: Reader, path: Path, case: Case, notes: Notes) -> Table | None:
    layout = case.source.bag
    topics = reader.topics
    if layout is None:
        notes.error(
            "the case does not say what to take from a bag",
            "declare source.bag (stamp_topic, stamp, max_age_s and fields); the bag has "
            f"{_described(topics)}",
        )
        return None
    readers = _topic_readers(topics, layout, notes)
    stamp_reader = readers.get(layout.stamp_topic)
    if stamp_reader is None:
        return None
    if layout.stamp == "header" and not stamp_reader.stamped:
        notes.error(
            "messages of the stamp topic have no header",
            "set source.bag.stamp: received, or take another stamp_topic",
            column=layout.stamp_topic,
            value=topics[layout.stamp_topic].msgtype,
        )
        return None
    connections = [item for topic in readers for item in topics[topic].connections]
    if not _collect(reader, connections, readers, layout, path, notes):
        return None
    if not _check_counts(topics, readers, notes):
        return None
    return make_samples(readers, case, layout, notes)


def _described(topics: Mapping[str, TopicInfo], first: str | None = None) -> str:
    """Return the topics with their types, the likeliest first."""
    names = sorted(topics, key=lambda name: (name != first, name))
    return listed([f"{name} ({topics[name].msgtype})" for name in names]) or "no topics"


def _topic_readers(
    topics: Mapping[str, TopicInfo], layout: BagFormat, notes: Notes
) -> dict[str, TopicReader]:
    """Return a reader for each topic that is there and understood; note the others."""
    wanted: dict[str, dict[str, str]] = {layout.stamp_topic: {}}
    for channel, path in layout.fields.items():
        topic, field = split_path(path)
        wanted.setdefault(topic, {})[channel] = field
    readers: dict[str, TopicReader] = {}
    for topic, paths in wanted.items():
        connection = _connection(topic, topics, notes)
        if connection is None:
            continue
        try:
            readers[topic] = TopicReader(connection, paths, layout.stamp, notes)
        except FieldFaultError as fault:
            notes.error(fault.problem, fault.remedy, column=topic)
        except Exception as fault:  # noqa: BLE001 - see read_bag
            reason = " ".join(str(fault).split())
            problem = f"the definition of {connection.msgtype} cannot be understood"
            notes.error(problem, "record the bag again", column=topic, value=reason)
    return readers


def _connection(topic: str, topics: Mapping[str, TopicInfo], notes: Notes) -> Connection | None:
    if topic not in topics:
        notes.error(
            "the bag has no such topic",
            f"change source.bag; the bag has {_described(topics, closest(topic, topics))}",
            column=topic,
        )
        return None
    info = topics[topic]
    if info.msgtype is None:
        kinds = ", ".join(sorted({item.msgtype for item in info.connections}))
        notes.error(
            "the topic has messages of several types",
            "record again with one type on the topic",
            column=topic,
            value=kinds,
        )
        return None
    if info.msgcount == 0:
        remedy = "record again while the topic is sent, or take another topic"
        notes.error("the topic has no messages", remedy, column=topic)
        return None
    return info.connections[0]


def _collect(
    reader: Reader,
    connections: list[Connection],
    readers: Mapping[str, TopicReader],
    layout: BagFormat,
    path: Path,
    notes: Notes,
) -> bool:
    """Give every message to its topic's reader; return whether the bag could be read to its end."""
    stamp_reader = readers[layout.stamp_topic]
    size = 0
    try:
        for connection, received_ns, raw in reader.messages(connections):
            size += len(raw)
            row = len(stamp_reader) + 1
            if not check_size(size, "part of the bag that is read", notes, row):
                return False
            readers[connection.topic].add(received_ns, raw)
    except Exception as fault:  # noqa: BLE001 - see read_bag
        _note_damage(path, fault, len(stamp_reader) + 1, notes)
        return False
    return True


def _check_counts(
    topics: Mapping[str, TopicInfo], readers: Mapping[str, TopicReader], notes: Notes
) -> bool:
    """Return whether every topic gave messages; note where the metadata counts otherwise."""
    for topic, reader in readers.items():
        counted, found = topics[topic].msgcount, len(reader)
        if found < counted:
            notes.error(
                "messages that the bag's metadata counts are missing",
                _REINDEX,
                column=topic,
                value=f"{counted - found} of {counted}",
            )
        elif found > counted:
            notes.warning(
                "the bag's metadata counts fewer messages than there are: all are read",
                _REINDEX,
                column=topic,
                value=f"{counted} of {found}",
            )
    return all(len(reader) for reader in readers.values())
