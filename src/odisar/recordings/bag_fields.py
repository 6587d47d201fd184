"""Find fields in ROS 2 messages: the way from a message to one of its numbers."""

import re
from collections.abc import Callable
from operator import attrgetter, itemgetter
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys.base import normalize_fieldname
from rosbags.typesys.store import Typestore

from odisar.recordings.bag_definitions import FieldFaultError, definitions, message_in
from odisar.recordings.table import closest, listed

__all__ = ["FieldFaultError", "Getter", "definitions", "has_header", "resolve", "split_path"]

_HEADER = "std_msgs/msg/Header"
_TIMES = frozenset({"builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"})
_INTEGERS = frozenset(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))
_NUMBERS = frozenset({"bool", "byte", "char", "octet", "float32", "float64"}) | _INTEGERS
_ELEMENT = re.compile(r"(\w+)(?:\[(\d+)\])?")

#: Takes one number out of a message; raises IndexError where an array is too short.
Getter = Callable[[Any], float]


def split_path(path: str) -> tuple[str, str]:
    """Return topic and field path of ``/topic:field.path``."""
    topic, _, field_path = path.partition(":")
    return topic, field_path


def has_header(store: Typestore, msgtype: str) -> bool:
    """Return whether messages of a type start with, or hold, a stamped header."""
    return ("header", _HEADER) in [(name, message_in(d)) for name, d in _fields(store, msgtype)]


def _fields(store: Typestore, msgtype: str) -> list[tuple[str, Any]]:
    return list(store.fielddefs[msgtype][1])


def resolve(store: Typestore, msgtype: str, path: str) -> Getter:
    """Return what takes the number at ``path`` (``pose.pose.position.x``) out of a message.

    Raises
    ------
    FieldFaultError
        If the message has no such field, or if it is no number.
    """
    desc: Any = (Nodetype.NAME, msgtype)
    getters: list[Callable[[Any], Any]] = []
    for element in path.split("."):
        match = _ELEMENT.fullmatch(element)
        if match is None:
            raise FieldFaultError(f"{element!r} is no field", "write it as in position[0]")
        name, index = match[1], match[2]
        desc = _field(store, desc, name)
        getters.append(attrgetter(normalize_fieldname(name)))
        if index is not None:
            desc = _item(desc, name, int(index))
            getters.append(itemgetter(int(index)))
    return _chain(getters, _last(store, desc, path))


def _field(store: Typestore, desc: Any, name: str) -> Any:
    kind, msgtype = desc
    if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        raise FieldFaultError("an array has no fields", f"name an element, as in [0].{name}")
    if kind != Nodetype.NAME:
        raise FieldFaultError(f"a {msgtype[0]} has no field {name!r}", f"leave out .{name}")
    fields = dict(_fields(store, msgtype))
    if name in fields:
        return fields[name]
    close = closest(name, fields)
    names = sorted(fields, key=lambda field: field != close)
    raise FieldFaultError(
        f"{msgtype} has no field {name!r}", f"take one that it has: {listed(names)}"
    )


def _item(desc: Any, name: str, index: int) -> Any:
    kind, detail = desc
    if kind not in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        raise FieldFaultError(f"{name!r} is no array", f"leave out [{index}]")
    item, size = detail
    if size and index >= size:
        raise FieldFaultError(
            f"{name}[{index}] is out of range: {name} has {size} elements",
            f"take an index from 0 to {size - 1}",
        )
    return item


def _last(store: Typestore, desc: Any, path: str) -> Callable[[Any], float]:
    """Return what makes a float of the field's value, if there is a way."""
    kind, detail = desc
    if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        raise FieldFaultError(f"{path} is an array", f"name an element, as in {path}[0]")
    if kind == Nodetype.NAME and detail in _TIMES:
        return _seconds
    if kind == Nodetype.NAME:
        names = listed([f"{path}.{name}" for name, _ in _fields(store, detail)])
        raise FieldFaultError(f"{path} is a message ({detail})", f"take one of its fields: {names}")
    if detail[0] not in _NUMBERS:
        raise FieldFaultError(f"{path} is no number but a {detail[0]}", "take another field")
    return float


def _seconds(moment: Any) -> float:
    return float(moment.sec + moment.nanosec * 1e-9)


def _chain(getters: list[Callable[[Any], Any]], last: Callable[[Any], float]) -> Getter:
    def get(message: Any) -> float:
        for getter in getters:
            message = getter(message)
        return last(message)

    return get
