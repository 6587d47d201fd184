"""Find fields in ROS 2 messages: the definition of a message, and the way to one of its numbers."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import attrgetter, itemgetter
from typing import Any

from rosbags.interfaces import Connection, MessageDefinition, MessageDefinitionFormat, Nodetype
from rosbags.typesys import (
    Stores,
    TypesysError,
    get_types_from_idl,
    get_types_from_msg,
    get_typestore,
)
from rosbags.typesys.base import normalize_fieldname
from rosbags.typesys.store import Typestore

from odisar.recordings.table import closest, listed

_HEADER = "std_msgs/msg/Header"
_TIMES = frozenset({"builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"})
_INTEGERS = frozenset(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))
_NUMBERS = frozenset({"bool", "byte", "char", "octet", "float32", "float64"}) | _INTEGERS
_ELEMENT = re.compile(r"(\w+)(?:\[(\d+)\])?")

# Definitions become Python source in rosbags: nothing but names may get there.
_TYPE_NAME = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*)+", re.ASCII)
_FIELD_NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)

_IDL_BORDER = "=" * 80 + "\n"

#: Takes one number out of a message; raises IndexError where an array is too short.
Getter = Callable[[Any], float]


@dataclass
class FieldFaultError(Exception):
    """A field that is not there or is no number, and what to do about it."""

    problem: str
    remedy: str


def split_path(path: str) -> tuple[str, str]:
    """Return topic and field path of ``/topic:field.path``."""
    topic, _, field_path = path.partition(":")
    return topic, field_path


def definitions(connection: Connection) -> Typestore:
    """Return what is needed to decode a topic's messages.

    Bags without definitions (SQLite, up to ROS 2 Humble) are read with those of ROS 2 Humble.

    Raises
    ------
    FieldFaultError
        If the definition is in neither, or cannot be understood.
    """
    types: dict[str, Any] = dict(_parse(connection.msgdef, connection.msgtype))
    known = get_typestore(Stores.ROS2_HUMBLE).fielddefs
    missing = [connection.msgtype]
    while missing:
        name = missing.pop()
        if name not in types:
            if name not in known:
                raise FieldFaultError(
                    f"the definition of {name} is unknown",
                    "record again with ROS 2 Iron or newer, or to MCAP: both keep definitions",
                )
            types[name] = known[name]
        _check_names(name, types[name])
        inner = (_message_in(desc) for _, desc in types[name][1])
        missing += [found for found in inner if found and found not in types]
    store = get_typestore(Stores.EMPTY)
    store.register(types)
    _check_hash(store, connection)
    return store


def _parse(definition: MessageDefinition, name: str) -> Mapping[str, Any]:
    if definition.format == MessageDefinitionFormat.NONE:
        return {}
    if definition.format == MessageDefinitionFormat.MSG:
        return get_types_from_msg(definition.data, name)
    if not definition.data.startswith(f"{_IDL_BORDER}IDL: "):
        return get_types_from_idl(definition.data)
    types: dict[str, Any] = {}
    for part in definition.data.split(_IDL_BORDER)[1:]:
        types |= get_types_from_idl(part.partition("\n")[2])
    return types


def _check_names(name: str, definition: Any) -> None:
    constants, fields = definition
    names = [constant[0] for constant in constants] + [field for field, _ in fields]
    if not _TYPE_NAME.fullmatch(name) or not all(map(_FIELD_NAME.fullmatch, names)):
        raise TypesysError(f"the definition of {name!r} has names that ROS does not allow")


def _message_in(desc: Any) -> str | None:
    """Return the type of the message that a field is or holds, if it is no basic type."""
    kind, detail = desc
    if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        kind, detail = detail[0]
    return str(detail) if kind == Nodetype.NAME else None


def _check_hash(store: Typestore, connection: Connection) -> None:
    if not connection.digest.startswith("RIHS01_"):
        return
    try:
        digest = store.hash_rihs01(connection.msgtype)
    except KeyError:  # a basic type that rosbags cannot hash
        return
    if digest != connection.digest:
        raise FieldFaultError(
            f"the definition of {connection.msgtype} is not the one that messages were made with",
            "record again to MCAP, which keeps definitions",
        )


def has_header(store: Typestore, msgtype: str) -> bool:
    """Return whether messages of a type start with, or hold, a stamped header."""
    return ("header", _HEADER) in [(name, _message_in(d)) for name, d in _fields(store, msgtype)]


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
