"""Read a case's folder of recordings: every file is checked before anything is raised."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from odisar.config.cases import Case
from odisar.recordings.checks import check_columns
from odisar.recordings.csv_reader import read_columns
from odisar.recordings.csv_text import read_text
from odisar.recordings.index import Index, default_info, describe, read_index
from odisar.recordings.labels import read_labels
from odisar.recordings.quality import Finding, Notes
from odisar.recordings.schema import Interval, Recording

INDEX_FILE = "recordings.csv"
LABELS_FILE = "labels.csv"

_TABLES = frozenset({INDEX_FILE, LABELS_FILE})

# Recordings in these formats are worth a word when they lie beside the CSV files, unread.
_OTHER_FORMATS = frozenset({
    ".bag", ".db3", ".feather", ".gz", ".h5", ".json", ".mat", ".mcap", ".npy", ".npz",
    ".parquet", ".tsv", ".txt", ".xls", ".xlsx", ".zip",
})  # fmt: skip


@dataclass(frozen=True)
class ReadResult:
    """The recordings of the files without an error, by name, and everything found on the way."""

    recordings: list[Recording] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)


def read_case(case_name: str, case: Case, root: Path) -> ReadResult:
    """Read and check every recording of a case.

    Each CSV file in ``root / case.source.folder`` is a recording named by its stem, but for
    ``recordings.csv`` (metadata) and ``labels.csv`` (labelled intervals), which may be missing.
    Nothing is filled, resampled or left out in silence. The values are (sample, channel) in the
    order of ``case.channels``.

    Pass the findings to ``raise_on_errors``: this function raises nothing, so that a report can
    show what was found.
    """
    shown = Path(case.source.folder)
    folder = root / shown
    folder_notes = Notes(shown.as_posix())
    paths = _list_files(folder, case, folder_notes)
    all_notes = [folder_notes]
    read: dict[str, Recording] = {}
    for path in paths:
        notes = Notes((shown / path.name).as_posix())
        all_notes.append(notes)
        recording = _read_recording(path, case_name, case, notes)
        if recording is not None:
            read[recording.name] = recording
    names = [path.stem for path in paths]
    index_notes = Notes((shown / INDEX_FILE).as_posix())
    labels_notes = Notes((shown / LABELS_FILE).as_posix())
    index = _index(folder / INDEX_FILE, case_name, case, names, index_notes)
    intervals = _intervals(folder / LABELS_FILE, names, read, case, labels_notes)
    all_notes += [index_notes, labels_notes]
    recordings = [
        describe(recording, index, intervals.get(name, ()), index_notes)
        for name, recording in read.items()
    ]
    return ReadResult(recordings, [finding for notes in all_notes for finding in notes.findings])


def _list_files(folder: Path, case: Case, notes: Notes) -> list[Path]:
    """Return the recordings' files, in the order of their names."""
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
    paths = [path for path in entries if _holds_table(path) and path.name not in _TABLES]
    for path in entries:
        if not _holds_table(path) and _may_hold_recordings(path):
            notes.warning("not a CSV file: it is not read", "export it as CSV", value=path.name)
    if not paths:
        notes.error("the folder holds no recording", "put one CSV file a recording into it")
    if len(paths) > case.source.max_recordings:
        notes.error(
            f"more recordings than source.max_recordings={case.source.max_recordings}",
            "remove some, or raise the limit if memory allows",
            value=f"{len(paths)} files",
        )
    return _without_twins(paths, notes)


def _holds_table(path: Path) -> bool:
    return path.suffix.lower() == ".csv" and not path.name.startswith(".")


def _may_hold_recordings(path: Path) -> bool:
    if path.name.startswith("."):
        return path.suffix.lower() == ".csv"
    if path.suffix.lower() in _OTHER_FORMATS:
        return True
    return path.is_dir() and os.access(path, os.R_OK) and any(path.glob("*.csv"))


def _without_twins(paths: Sequence[Path], notes: Notes) -> list[Path]:
    """Return the paths, without those whose name differs from another only after the stem."""
    unique: dict[str, Path] = {}
    for path in paths:
        if path.stem in unique:
            notes.error(
                f"two files are named {path.stem!r}: only {unique[path.stem].name} was checked",
                "rename one of them",
                value=path.name,
            )
        unique.setdefault(path.stem, path)
    return list(unique.values())


def _read_recording(path: Path, case_name: str, case: Case, notes: Notes) -> Recording | None:
    """Return the recording in a file, not yet described, or None with the reasons in ``notes``."""
    text = read_text(path, notes)
    if text is None:
        return None
    columns = read_columns(text, [case.source.time_column, *case.channel_names], notes)
    if columns is None:
        return None
    segments = check_columns(columns, case, notes)
    if notes.has_errors:
        return None
    return Recording(
        name=path.stem,
        info=default_info(case_name, case),
        time_s=np.ascontiguousarray(columns.values[:, 0]),
        values=np.ascontiguousarray(columns.values[:, 1:]),
        segments=segments,
    )


def _index(
    path: Path, case_name: str, case: Case, names: Sequence[str], notes: Notes
) -> Index | None:
    if path.exists():
        return read_index(path, case_name, case, names, notes)
    if case.splits.kind == "metadata":
        notes.error(
            "splits.kind=metadata needs this file",
            "write it with the columns recording and split, or use splits.kind=fractions",
        )
    return None


def _intervals(
    path: Path,
    names: Sequence[str],
    read: Mapping[str, Recording],
    case: Case,
    notes: Notes,
) -> dict[str, list[Interval]]:
    if not path.exists():
        return {}
    spans = {
        name: (float(recording.time_s[0]), float(recording.time_s[-1]) + 1.0 / case.rate_hz)
        for name, recording in read.items()
    }
    return read_labels(path, names, spans, notes)
