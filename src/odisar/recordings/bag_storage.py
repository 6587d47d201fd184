"""The files of a ROS 2 bag: whether they can be opened, and which is to blame if they cannot."""

from functools import partial
from pathlib import Path

import pyarrow as pa  # type: ignore[import-untyped]
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.storage_mcap import DECOMPRESSORS

from odisar.recordings import file_checks
from odisar.recordings.file_checks import (
    check_file,
    check_size,
    is_special,
    note_special,
    note_unreadable,
)
from odisar.recordings.folder import BAG_FILES, BAG_METADATA, bag_files
from odisar.recordings.quality import Notes

REINDEX = "run `ros2 bag reindex` on it, or record again"
_REPAIR = (
    "copy or record it again, or repair it (sqlite3 .recover, mcap recover; then "
    "`ros2 bag reindex`)"
)
_CONVERT = "convert it to a ROS 2 bag (cdr messages with ros2msg or ros2idl schemas)"

_CHUNK_BYTES = 1024**2

# https://datatracker.ietf.org/doc/html/rfc8878, 3.1.1
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"

# Kinds of schemas that MCAP files have but ROS 2 does not: https://mcap.dev/spec/registry
_OTHER_SCHEMAS = frozenset({"protobuf", "flatbuffer", "jsonschema", "ros1msg"})


def is_complete(path: Path, notes: Notes) -> bool:
    """Return whether a bag has its metadata and no messages outside of its files."""
    try:
        if path.is_dir():
            return _is_complete_folder(path, notes)
        if is_special(path):
            note_special(path, notes)
            return False
        size = path.stat().st_size
    except OSError as fault:
        note_unreadable(fault, notes)
        return False
    if not size:
        notes.error("the file is empty", "record it again, or remove it")
        return False
    if path.suffix not in BAG_FILES:
        remedy = f"rename it to lower case: {path.stem}{path.suffix.lower()}"
        notes.error("the end of the file's name is not in lower case", remedy, value=path.suffix)
        return False
    return _is_finished(path, notes)


def _is_complete_folder(path: Path, notes: Notes) -> bool:
    # The metadata may name any of them.
    special = [file for file in sorted(path.iterdir()) if is_special(file)]
    for file in special:
        note_special(file, notes)
    files = bag_files(path)
    metadata = path / BAG_METADATA
    if special:
        return False
    if not metadata.exists():
        alone = f", or move {files[0].name} out of its folder" if len(files) == 1 else ""
        notes.error(f"the bag has no {BAG_METADATA}", f"{REINDEX}{alone}")
        return False
    if not check_file(metadata, notes):
        return False
    text = metadata.read_text(encoding="utf-8", errors="replace")
    for file in files:
        if file.name not in text:
            problem = f"a file that {BAG_METADATA} does not list is not read"
            notes.warning(problem, f"{REINDEX}, or remove the file", value=file.name)
    unfinished = [file for file in files if not _is_finished(file, notes)]
    return not unfinished and _is_small_unpacked(path, notes)


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


def _is_small_unpacked(path: Path, notes: Notes) -> bool:
    """Return whether the compressed files of a bag stay within the limit, all together."""
    size = 0
    # Whatever a file is called, the metadata may name it.
    for file in sorted(path.iterdir()):
        if not file.is_file() or not _is_zstd(file):
            continue
        try:
            with pa.input_stream(file, compression="zstd") as stream:
                while size <= file_checks.MAX_FILE_BYTES and (chunk := stream.read(_CHUNK_BYTES)):
                    size += len(chunk)
        except (OSError, pa.ArrowException):
            continue  # opening the bag tells what is wrong with the file
    return check_size(size, "decompressed bag", notes)


def _is_zstd(file: Path) -> bool:
    with file.open("rb") as opened:
        return opened.read(len(_ZSTD_MAGIC)) == _ZSTD_MAGIC


def decompressed(raw: bytes) -> bytes:
    """Return a message that is compressed by itself, cut off just above the limit of a file.

    Raises
    ------
    OSError
        If it is no zstd data.
    """
    return _first_bytes(raw, "zstd", file_checks.MAX_FILE_BYTES + 1)


def _first_bytes(raw: bytes, codec: str, limit: int) -> bytes:
    parts = []
    with pa.input_stream(pa.BufferReader(raw), compression=codec) as stream:
        while limit > 0 and (part := stream.read(min(limit, _CHUNK_BYTES))):
            parts.append(part)
            limit -= len(part)
    return b"".join(parts)


def _chunk(codec: str, raw: bytes, size: int) -> bytes:
    """Return a chunk of an MCAP file; one byte more than it states tells rosbags of its damage."""
    if size > file_checks.MAX_FILE_BYTES:
        raise OSError(f"a chunk of {size} bytes is larger than the limit of a file")
    return _first_bytes(raw, codec, size + 1)


# rosbags decompresses chunks without a limit, whatever size they state.
DECOMPRESSORS.update({codec: partial(_chunk, codec) for codec in ("lz4", "zstd")})


def note_damage(path: Path, fault: Exception, row: int | None, notes: Notes) -> None:
    """Note why a bag cannot be read (on), and which of its files is to blame."""
    reason = " ".join(str(fault).replace(f"{path.parent}/", "").split()) or type(fault).__name__
    if _is_of_another_system(fault):
        notes.error("not a ROS 2 bag", _CONVERT, value=reason)
        return
    if not path.is_dir():
        notes.error(f"{path.name} is cut off or damaged", _REPAIR, row=row, value=reason)
        return
    damaged = next((file.name for file in bag_files(path) if not _is_readable(file)), None)
    if damaged is None:
        notes.error(f"the bag does not fit its {BAG_METADATA}", REINDEX, row=row, value=reason)
        return
    notes.error(f"{damaged} is cut off or damaged", _REPAIR, row=row, value=reason)


def _is_of_another_system(fault: Exception) -> bool:
    """Return whether rosbags stumbled over an MCAP file that is sound but not of ROS 2."""
    if isinstance(fault, KeyError):
        return bool(fault.args) and fault.args[0] in _OTHER_SCHEMAS
    return "Profile is not ros2" in str(fault)


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
    except Exception:  # noqa: BLE001 - see bag_reader.read_bag
        return False
    return True
