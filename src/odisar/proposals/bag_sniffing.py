"""Look at the first messages of ROS 2 bags: the topic of samples, the fields."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader

from odisar.proposals.bag_fields import Field, make_field, numeric_paths
from odisar.proposals.samples import Sample, UnusableError, none_usable
from odisar.recordings.bag_fields import definitions, has_header, split_path
from odisar.recordings.bag_storage import is_complete, note_damage
from odisar.recordings.bag_topic import Series, TopicReader
from odisar.recordings.quality import Finding, Notes

#: The name of the time column of samples from bags.
BAG_TIME = "time_s"
_MESSAGES = 20_000
_FIELDS_A_TOPIC = 40
_UNFIT_TOPIC = re.compile(
    r"/(rosout|parameter_events|tf|tf_static|clock)$|/diagnostics|/_|_statistics$"
)
_ODOMETRY = "nav_msgs/msg/Odometry"
_IMU = "sensor_msgs/msg/Imu"


@dataclass(frozen=True)
class Topic:
    """A topic that bags share: messages a second, and the numbers that its messages hold."""

    name: str
    msgtype: str
    rate_hz: float
    has_header: bool
    fields: tuple[Field, ...]


@dataclass(frozen=True)
class BagLook:
    """What a proposal takes from bags: ``source.bag``, the samples it makes, and doubts.

    ``undated`` are topics with a header whose stamp is 0, in all or some of the messages.
    """

    stamp: Topic
    topics: tuple[Topic, ...]
    max_age_s: float
    fields: tuple[Field, ...]
    samples: tuple[Sample, ...]
    unusable: Mapping[str, str]
    undated: tuple[str, ...]

    @property
    def clock(self) -> str:
        """``header`` where the stamp topic has one that is filled in."""
        return "header" if self.stamp.has_header else "received"


def sniff_bags(paths: Sequence[Path], others: Sequence[Path] = ()) -> BagLook:
    """Return a look at bags, at one of the ``others`` where none of these can be read.

    Raises
    ------
    UnusableError
        If none can be read, with what is wrong with each, or if none has a topic with numbers.
    """
    found: dict[Path, dict[str, Topic]] = {}
    findings: list[Finding] = []
    for path in (*paths, *others):
        if found and path in others:
            break
        notes = Notes(path.name)
        held = _readable_topics(path, notes)
        if held is not None:
            found[path] = held
        findings += [item for item in notes.findings if item.severity == "error"]
    if not found:
        raise UnusableError(none_usable([(f.file, _told(f), f.remedy) for f in findings]))
    shared = _shared(list(found.values()))
    if not shared:
        raise UnusableError("no topic that the bags share can make samples: none has numbers")
    stamp = max(shared.values(), key=lambda topic: _rank(topic)[:3])
    order = [stamp, *sorted(shared.values(), key=_rank, reverse=True)]
    topics = tuple(dict.fromkeys(order))
    candidates = _named(topics)
    looks = {path: _series(path, stamp, candidates) for path in found}
    undated = tuple(sorted({topic for look in looks.values() for topic in look.undated}))
    if undated:
        stamp = replace(stamp, has_header=False)
        looks = {path: _series(path, stamp, candidates) for path in found}
    samples = [Sample(path, look.table, remarks=look.remarks) for path, look in looks.items()]
    age_s = max(look.longest_age_s for look in looks.values())
    unusable = {item.file: f"{_told(item)}; {item.remedy}" for item in findings}
    return BagLook(stamp, topics, age_s, tuple(candidates), tuple(samples), unusable, undated)


def _told(finding: Finding) -> str:
    return f"{finding.problem} ({finding.value})" if finding.value else finding.problem


def _readable_topics(path: Path, notes: Notes) -> dict[str, Topic] | None:
    """Return the topics of a bag with numbers; None where it can't be read, which is noted."""
    if not is_complete(path, notes):
        return None
    try:
        return _topics(path)
    except Exception as fault:  # noqa: BLE001 - a damaged bag makes rosbags raise anything
        note_damage(path, fault, None, notes)
        return None


def _topics(path: Path) -> dict[str, Topic]:
    """Return the topics of a bag whose messages hold numbers."""
    topics: dict[str, Topic] = {}
    with Reader(path) as reader:
        seconds = max(reader.duration / 1e9, 1e-3)
        for name, info in reader.topics.items():
            usable = info.msgcount > 1 and info.msgtype and not _UNFIT_TOPIC.search(name)
            topic = _topic(reader, info.connections[0], info.msgcount / seconds) if usable else None
            if topic is not None:
                topics[name] = topic
    return topics


def _topic(reader: Reader, connection: Connection, rate_hz: float) -> Topic | None:
    try:
        store = definitions(connection)
        _, _, raw = next(iter(reader.messages([connection])))
        first: Any = store.deserialize_cdr(raw, connection.msgtype)
        paths = list(numeric_paths(store, connection.msgtype, first))
        stamped = has_header(store, connection.msgtype)
    except Exception:  # noqa: BLE001 - a topic that cannot be decoded is none to propose
        return None
    if not 0 < len(paths) <= _FIELDS_A_TOPIC:
        return None
    fields = tuple(make_field(connection.topic, path, first) for path in paths)
    return Topic(connection.topic, connection.msgtype, rate_hz, stamped, fields)


def _shared(bags: Sequence[Mapping[str, Topic]]) -> dict[str, Topic]:
    """Return the topics that most bags have; those of a few would keep the others from use."""
    counts = Counter(name for bag in bags for name in bag)
    most = max(counts.values(), default=0)
    kept = [name for name, count in counts.items() if count == most]
    return {name: next(bag[name] for bag in bags if name in bag) for name in kept}


def _rank(topic: Topic) -> tuple[object, ...]:
    """Order topics: odometry first, then the fastest with a header."""
    return (
        topic.msgtype == _ODOMETRY,
        topic.has_header,
        round(topic.rate_hz),
        topic.msgtype == _IMU,
        topic.name,
    )


def _named(topics: Sequence[Topic]) -> list[Field]:
    """Return the fields of all topics under names that differ."""
    fields: list[Field] = []
    has_odometry = any(topic.msgtype == _ODOMETRY for topic in topics)
    for topic in topics:
        for field in topic.fields:
            # The same orientation twice would be learnt twice.
            if topic.msgtype == _IMU and has_odometry and ":orientation." in field.path:
                continue
            taken = {item.channel for item in fields}
            name = field.channel
            if name in taken:
                short = re.sub(r"\W+", "_", topic.name.strip("/"))
                name = f"{short}_{name}"
            if name not in taken:
                fields.append(replace(field, channel=name))
    return fields


@dataclass(frozen=True)
class _Look:
    table: pd.DataFrame
    undated: tuple[str, ...]
    longest_age_s: float
    remarks: tuple[str, ...]


def _series(path: Path, stamp: Topic, fields: Sequence[Field]) -> _Look:
    """Return the first samples of a bag, one for each message of the stamp topic."""
    notes = Notes(path.name)
    clock = "header" if stamp.has_header else "received"
    with Reader(path) as reader:
        paths: dict[str, dict[str, str]] = {stamp.name: {}}
        for field in fields:
            topic, inner = split_path(field.path)
            if topic in reader.topics:
                paths.setdefault(topic, {})[field.channel] = inner
        connections = {name: reader.topics[name].connections[0] for name in paths}
        readers = {
            name: TopicReader(connections[name], wanted, clock, notes)
            for name, wanted in paths.items()
        }
        rest = 0
        for read, (connection, received_ns, raw) in enumerate(
            reader.messages(list(connections.values()))
        ):
            if read >= _MESSAGES:
                rest = 1
                break
            readers[connection.topic].add(received_ns, raw)
    series = {name: topic.series() for name, topic in readers.items() if len(topic)}
    undated = tuple(name for name, one in series.items() if not one.dated)
    table = _join(series, readers, stamp.name)
    remarks = (f"only its first {_MESSAGES} messages were looked at",) if rest else ()
    return _Look(table, undated, _longest_age_s(series), remarks)


def _join(
    series: Mapping[str, Series], readers: Mapping[str, TopicReader], stamp: str
) -> pd.DataFrame:
    at_ns = series[stamp].stamps_ns
    columns: dict[str, Any] = {BAG_TIME: (at_ns - at_ns[0]) / 1e9}
    for name, other in series.items():
        rows = np.searchsorted(other.stamps_ns, at_ns, side="right") - 1
        if name == stamp:
            rows = np.arange(len(at_ns))
        for place, channel in enumerate(readers[name].channels):
            held = other.values[np.maximum(rows, 0), place]
            columns[channel] = np.where(rows >= 0, held, np.nan)
    table = pd.DataFrame(columns)
    known = table.notna().all(axis=1).to_numpy()
    return table.iloc[int(np.argmax(known)) :].reset_index(drop=True) if known.any() else table


def _longest_age_s(series: Mapping[str, Series]) -> float:
    """Return the longest time between two messages of any topic, in seconds."""
    pauses = [np.diff(one.stamps_ns).max() / 1e9 for one in series.values() if len(one.values) > 1]
    return float(max(pauses, default=1.0))
