"""What lies in a case's folder: the recordings, their formats, and what is not read."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from odisar.config.cases import Case
from odisar.recordings.quality import Notes

INDEX_FILE = "recordings.csv"
LABELS_FILE = "labels.csv"

Format = Literal["csv", "parquet", "bag"]

#: The file that makes a folder a ROS 2 bag.
BAG_METADATA = "metadata.yaml"

#: Files in which a bag keeps its messages.
BAG_FILES = frozenset({".db3", ".mcap"})

_TABLES = frozenset({INDEX_FILE, LABELS_FILE})

_FORMATS: dict[str, Format] = {".csv": "csv", ".parquet": "parquet"}

# Recordings in these formats are worth a word when they lie beside the others, unread.
_OTHER_FORMATS = frozenset({
    ".active", ".arrow", ".bag", ".feather", ".gz", ".h5", ".json", ".mat", ".npy", ".npz", ".pq",
    ".tsv", ".txt", ".xls", ".xlsx", ".zip", ".zstd",
})  # fmt: skip


def list_recordings(folder: Path, case: Case, notes: Notes) -> list[Path]:
    """Return the files (and bags' folders) of the recordings, in the order of their names."""
    if not folder.is_dir():
        notes.error(
            "the folder of recordings does not exist" if not folder.exists() else "not a folder",
            "create it, or change source.folder of the case",
        )
        return []
    try:
        entries = sorted(folder.iterdir(), key=lambda path: path.name)
    except OSError as fault:
        notes.error("the folder cannot be read", "check that you may read it", value=fault.strerror)
        return []
    if any(path.name == BAG_METADATA for path in entries):
        notes.error(
            "the folder is itself a ROS 2 bag",
            "set source.folder to a folder that holds it",
            value=BAG_METADATA,
        )
        return []
    paths = [path for path in entries if _is_recording(path)]
    for path in entries:
        if path.name not in _TABLES and not _is_recording(path):
            _note_unread(path, notes)
    if not paths:
        notes.error(
            "the folder holds no recording",
            "put a CSV file, a Parquet file or a ROS 2 bag for each recording into it",
        )
    if len(paths) > case.source.max_recordings:
        notes.error(
            f"more recordings than source.max_recordings={case.source.max_recordings}",
            "remove some, or raise the limit if memory allows",
            value=f"{len(paths)} files",
        )
    return _without_twins(paths, notes)


def format_of(path: Path) -> Format:
    """Return the format of a recording's file or folder."""
    return "bag" if _is_bag(path) else _FORMATS[path.suffix.lower()]


def recording_name(path: Path) -> str:
    """Return the name of the recording in a file (its stem) or in a bag's folder (its name)."""
    return path.name if _is_bag_folder(path) else path.stem


def bag_files(folder: Path) -> list[Path]:
    """Return the files in which a bag's folder keeps messages, compressed ones included."""
    return sorted(
        path
        for path in folder.iterdir()
        if (path.with_suffix("") if path.suffix == ".zstd" else path).suffix in BAG_FILES
    )


def _is_recording(path: Path) -> bool:
    if path.name.startswith(".") or path.name in _TABLES:
        return False
    return path.suffix.lower() in _FORMATS or _is_bag(path)


def _is_bag(path: Path) -> bool:
    if path.is_dir():
        return _is_bag_folder(path)
    return path.suffix.lower() in BAG_FILES


def _is_bag_folder(path: Path) -> bool:
    if not path.is_dir() or not os.access(path, os.R_OK | os.X_OK):
        return False
    return (path / BAG_METADATA).exists() or bool(bag_files(path))


def _note_unread(path: Path, notes: Notes) -> None:
    if path.suffix == ".bag":
        notes.warning(
            "a ROS 1 bag: it is not read",
            f"convert it: rosbags-convert --src {path.name} --dst {path.stem}",
            value=path.name,
        )
    elif _may_hold_recordings(path):
        notes.warning(
            "not a CSV or Parquet file nor a ROS 2 bag: it is not read",
            "export it as CSV or Parquet",
            value=path.name,
        )


def _may_hold_recordings(path: Path) -> bool:
    if path.name.startswith("."):
        return path.suffix.lower() in _FORMATS
    if path.suffix.lower() in _OTHER_FORMATS:
        return True
    if not path.is_dir() or not os.access(path, os.R_OK | os.X_OK):
        return False
    return any(_is_recording(inner) for inner in path.iterdir())


def _without_twins(paths: Sequence[Path], notes: Notes) -> list[Path]:
    """Return the paths, without those whose recordings have the name of an earlier one."""
    unique: dict[str, Path] = {}
    for path in paths:
        name = recording_name(path)
        if name in unique:
            notes.error(
                f"two files are named {name!r}: only {unique[name].name} was checked",
                "rename one of them",
                value=path.name,
            )
        unique.setdefault(name, path)
    return list(unique.values())
