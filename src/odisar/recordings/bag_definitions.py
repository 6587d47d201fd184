"""What messages of a ROS 2 bag are made of, as the bag itself defines it; nothing is trusted."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rosbags.interfaces import Connection, MessageDefinition, MessageDefinitionFormat, Nodetype
from rosbags.typesys import (
    Stores,
    TypesysError,
    get_types_from_idl,
    get_types_from_msg,
    get_typestore,
)
from rosbags.typesys.store import Typestore

# Definitions become Python source in rosbags: nothing but names may get there.
_TYPE_NAME = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*)+", re.ASCII)
_FIELD_NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)

_IDL_BORDER = "=" * 80 + "\n"

# Comments and texts of an IDL definition, which may hold anything.
_IDL_TEXTS = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'(?:[^'\\]|\\.)'|//[^\n]*|/\*.*?\*/", re.DOTALL)
# Reading these takes rosbags time or memory that doubles with every character.
_IDL_COSTLY = re.compile(r"<<|\bconst\b[^;]*\(|\([^)]*\(|\[[^\]]*\(")

# Far beyond any message of a robot; what rosbags makes of more takes minutes or the memory.
_MAX_CHARACTERS = 256 * 1024
_MAX_FIELDS = 2000
_MAX_NUMBERS = 10**6
_MAX_ITEMS = 1000


@dataclass
class FieldFaultError(Exception):
    """A field that is not there or is no number, and what to do about it."""

    problem: str
    remedy: str


def definitions(connection: Connection) -> Typestore:
    """Return what is needed to decode a topic's messages.

    Bags without definitions (SQLite, up to ROS 2 Humble) are read with those of ROS 2 Humble.

    Raises
    ------
    FieldFaultError
        If the definition is in neither, is too large or cannot be understood.
    """
    _check_text(connection)
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
        inner = (message_in(desc) for _, desc in types[name][1])
        missing += [found for found in inner if found and found not in types]
    for name, definition in types.items():
        _check_names(name, definition)
    _check_sizes(connection.msgtype, types)
    store = get_typestore(Stores.EMPTY)
    store.register(types)
    _check_hash(store, connection)
    return store


def _check_text(connection: Connection) -> None:
    """Raise where the text of a definition is such that parsing it would not end."""
    definition = connection.msgdef
    if len(definition.data) > _MAX_CHARACTERS:
        raise _too_large(connection.msgtype, f"it has more than {_MAX_CHARACTERS:,} characters")
    if definition.format == MessageDefinitionFormat.IDL:
        costly = _IDL_COSTLY.search(_IDL_TEXTS.sub(" ", definition.data))
        if costly:
            raise _too_large(connection.msgtype, f"it has to be worked out ({costly[0][-20:]!r})")


def _check_sizes(msgtype: str, types: Mapping[str, Any]) -> None:
    """Raise where code for the definitions, or one message, would be too large."""
    if sum(len(fields) for _, fields in types.values()) > _MAX_FIELDS:
        raise _too_large(msgtype, f"it has more than {_MAX_FIELDS:,} fields")
    for name, (_, fields) in types.items():
        for field, (kind, detail) in fields:
            if kind != Nodetype.ARRAY:
                continue
            (item_kind, item), size = detail
            plain = item_kind == Nodetype.BASE and "string" not in item[0]
            limit = _MAX_NUMBERS if plain else _MAX_ITEMS
            if size > limit:
                raise _too_large(msgtype, f"{field} of {name} has more than {limit:,} elements")


def _too_large(msgtype: str, reason: str) -> FieldFaultError:
    return FieldFaultError(
        f"the definition of {msgtype} is too large: {reason}",
        "take another topic, or export what is wanted of it to Parquet",
    )


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
    kinds = [name, *filter(None, (message_in(desc) for _, desc in fields))]
    if not all(map(_TYPE_NAME.fullmatch, kinds)) or not all(map(_FIELD_NAME.fullmatch, names)):
        raise TypesysError(f"the definition of {name!r} has names that ROS does not allow")


def message_in(desc: Any) -> str | None:
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
