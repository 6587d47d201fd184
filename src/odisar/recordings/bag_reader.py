"""Read one ROS 2 bag into numbers: a sample for each message of one topic."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection, MessageDefinitionFormat, TopicInfo
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.reader import DirectoryReader

from odisar.config.cases import Case
from odisar.config.formats import BagFormat
from odisar.recordings.bag_definitions import FieldFaultError
from odisar.recordings.bag_fields import split_path
from odisar.recordings.bag_samples import make_samples
from odisar.recordings.bag_storage import REINDEX, decompressed, is_complete, note_damage
from odisar.recordings.bag_topic import TopicReader
from odisar.recordings.file_checks import check_size
from odisar.recordings.quality import Notes
from odisar.recordings.table import Table, closest, listed

# Nanoseconds since 1970 that a 64-bit integer holds: until the year 2262.
_LAST_NS = 2**63 - 1


def read_bag(path: Path, case: Case, notes: Notes) -> Table | None:
    """Return time and channels at each message of ``source.bag.stamp_topic``, or None.

    ``path`` is the folder of a bag, or a file of messages (SQLite or MCAP) by itself. Messages
    are numbered from 1, as the bag gives them. Everything wrong goes to ``notes``.
    """
    if not is_complete(path, notes):
        return None
    try:
        reader = Reader(path)
        reader.open()
    except Exception as fault:  # noqa: BLE001 - a damaged bag makes rosbags raise anything
        note_damage(path, fault, None, notes)
        return None
    try:
        return _read(reader, path, case, notes)
    finally:
        reader.close()


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
    readers = _topic_readers(reader, topics, layout, notes)
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
    reader: Reader, topics: Mapping[str, TopicInfo], layout: BagFormat, notes: Notes
) -> dict[str, TopicReader]:
    """Return a reader for each topic that is there and understood; note the others."""
    wanted: dict[str, dict[str, str]] = {layout.stamp_topic: {}}
    for channel, path in layout.fields.items():
        topic, field = split_path(path)
        wanted.setdefault(topic, {})[channel] = field
    readers: dict[str, TopicReader] = {}
    for topic, paths in wanted.items():
        connection = _connection(topic, topics, notes)
        if connection is None or not _has_one_definition(reader, topic, notes):
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


def _storages(reader: Reader) -> Sequence[Any]:
    """Return rosbags' readers of the files of messages: several in a folder, else one."""
    if isinstance(reader.storage, DirectoryReader):
        return reader.storage.storages
    return [reader.storage]


def _has_one_definition(reader: Reader, topic: str, notes: Notes) -> bool:
    """Return whether all messages of a topic, in all files, were made with one definition."""
    found = [item for one in _storages(reader) for item in one.connections if item.topic == topic]
    # A file without definitions says nothing about them.
    texts = {item.msgdef for item in found if item.msgdef.format != MessageDefinitionFormat.NONE}
    digests = {item.digest for item in found if item.digest}
    if len(texts) <= 1 and len(digests) <= 1:
        return True
    notes.error(
        "the topic has messages of several definitions",
        "cut the bag, or record again with one version of the message on the topic",
        column=topic,
        value=f"{max(len(texts), len(digests))} definitions of {found[0].msgtype}",
    )
    return False


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
        for connection, received_ns, raw in _messages(reader, connections):
            size += len(raw)
            row = len(stamp_reader) + 1
            if not check_size(size, "part of the bag that is read", notes, row):
                return False
            topic_reader = readers[connection.topic]
            if not isinstance(received_ns, int) or not 0 <= received_ns <= _LAST_NS:
                notes.error(
                    "the time of arrival is no whole number of nanoseconds since 1970",
                    "record or convert the bag again",
                    column=connection.topic,
                    row=len(topic_reader) + 1,
                    value=repr(received_ns),
                )
                return False
            topic_reader.add(received_ns, raw)
    except Exception as fault:  # noqa: BLE001 - see read_bag
        note_damage(path, fault, len(stamp_reader) + 1, notes)
        return False
    return True


def _messages(
    reader: Reader, connections: list[Connection]
) -> Iterator[tuple[Connection, int, bytes]]:
    """Yield the messages; those that are compressed one by one only up to the limit of a file."""
    storage = reader.storage
    if storage.metadata.compression_mode != "message":
        yield from reader.messages(connections)
        return
    assert isinstance(storage, DirectoryReader)  # noqa: S101 - nothing else has a mode
    # rosbags would decompress without a limit: it is told that there is nothing to decompress.
    storage.metadata = storage.metadata._replace(compression_mode=None)
    for connection, received_ns, raw in reader.messages(connections):
        yield connection, received_ns, decompressed(raw)


def _check_counts(
    topics: Mapping[str, TopicInfo], readers: Mapping[str, TopicReader], notes: Notes
) -> bool:
    """Return whether every topic gave messages; note where the metadata counts otherwise."""
    for topic, reader in readers.items():
        counted, found = topics[topic].msgcount, len(reader)
        if found < counted:
            notes.error(
                "messages that the bag's metadata counts are missing",
                REINDEX,
                column=topic,
                value=f"{counted - found} of {counted}",
            )
        elif found > counted:
            notes.warning(
                "the bag's metadata counts fewer messages than there are: all are read",
                REINDEX,
                column=topic,
                value=f"{counted} of {found}",
            )
    return all(len(reader) for reader in readers.values())
