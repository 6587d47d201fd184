"""Which numbers the messages of a ROS 2 topic hold, what to call them, and their units."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore

_NUMBERS = re.compile(r"(u?int(8|16|32|64)|float(32|64)|bool|byte|char|octet)")
_TIMES = frozenset({"builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"})
_HEADER = "std_msgs/msg/Header"
_SMALL_ARRAY = 4

_COMMAND_TOPIC = re.compile(r"cmd|command|setpoint|reference|target|desired|control_input", re.I)

# Units that ROS fixes for the fields of its common messages (REP 103).
_UNITS = (
    (re.compile(r"(^|\.)position\.[xyz]$"), "m"),
    (re.compile(r"orientation\.[xyzw]$|rotation\.[xyzw]$"), "1"),
    (re.compile(r"linear_acceleration\.[xyz]$"), "m/s2"),
    (re.compile(r"angular_velocity\.[xyz]$|(^|\.)angular\.[xyz]$"), "rad/s"),
    (re.compile(r"(^|\.)linear\.[xyz]$"), "m/s"),
    (re.compile(r"(^|\.)(latitude|longitude)$"), "deg"),
    (re.compile(r"(^|\.)range$"), "m"),
    (re.compile(r"(^|\.)force\.[xyz]$"), "N"),
    (re.compile(r"(^|\.)torque\.[xyz]$"), "Nm"),
    (re.compile(r"(^|\.)voltage$"), "V"),
    (re.compile(r"(^|\.)current$"), "A"),
)
_JOINT_UNITS = {"position": "rad", "velocity": "rad/s", "effort": "Nm"}


@dataclass(frozen=True)
class Field:
    """One number of a topic's messages, as a channel: ``path`` is ``/topic:field.path``."""

    channel: str
    path: str
    unit: str | None
    is_command: bool


def numeric_paths(store: Typestore, msgtype: str, first: Any) -> Iterator[str]:
    """Yield the way to every number of a message, but for headers, times and covariances.

    Sequences are taken from messages with a ``name`` for each element (as joint states have),
    as many as the ``first`` message has.
    """
    yield from _paths(store, msgtype, "")
    names = getattr(first, "name", None)
    if not isinstance(names, list):
        return
    for name, desc in store.fielddefs[msgtype][1]:
        kind, detail = desc
        values = getattr(first, name, ())
        if kind == Nodetype.SEQUENCE and _is_number(detail[0]) and len(values) == len(names):
            yield from (f"{name}[{i}]" for i in range(len(names)))


def _paths(store: Typestore, msgtype: str, prefix: str) -> Iterator[str]:
    for name, (kind, detail) in store.fielddefs[msgtype][1]:
        path = f"{prefix}{name}"
        if "covariance" in name:
            continue
        if kind == Nodetype.NAME:
            if detail not in _TIMES and detail != _HEADER:
                yield from _paths(store, str(detail), f"{path}.")
        elif kind == Nodetype.BASE:
            if _is_number((kind, detail)):
                yield path
        elif kind == Nodetype.ARRAY and _is_number(detail[0]):
            size = int(detail[1])
            yield from (f"{path}[{i}]" for i in range(size if size <= _SMALL_ARRAY else 0))


def _is_number(desc: Any) -> bool:
    kind, detail = desc
    return kind == Nodetype.BASE and bool(_NUMBERS.fullmatch(str(detail[0])))


def make_field(topic: str, path: str, first: Any) -> Field:
    """Return a number of a topic as a channel; other topics may have channels of the same name."""
    is_command = bool(_COMMAND_TOPIC.search(topic))
    name = _channel_name(topic, path, first)
    return Field(
        f"command_{name}" if is_command else name, f"{topic}:{path}", _unit(path, first), is_command
    )


def _channel_name(topic: str, path: str, first: Any) -> str:
    if path == "data":  # a message of a single number is called what its topic is
        return re.sub(r"\W+", "_", topic).strip("_")
    joint = re.fullmatch(r"(\w+)\[(\d+)\]", path)
    if joint and isinstance(getattr(first, "name", None), list):
        joint_name = re.sub(r"\W+", "_", first.name[int(joint[2])])
        return f"{joint[1]}_{joint_name}"
    parts = re.sub(r"\[(\d+)\]", r".\1", path).split(".")
    if len(parts) > 1 and parts[-2] in ("linear", "angular"):
        parts[-2] += "_velocity"
    return "_".join(parts[-2:])


def _unit(path: str, first: Any) -> str | None:
    joint = re.fullmatch(r"(\w+)\[\d+\]", path)
    if joint and hasattr(first, "name"):
        return _JOINT_UNITS.get(joint[1])
    return next((unit for pattern, unit in _UNITS if pattern.search(path)), None)
