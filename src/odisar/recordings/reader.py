"""Read a case's folder of recordings: every file is checked before anything is raised."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from odisar.config.cases import Case
from odisar.recordings.bag_reader import read_bag
from odisar.recordings.checks import check_table
from odisar.recordings.csv_reader import read_csv
from odisar.recordings.folder import (
    INDEX_FILE,
    LABELS_FILE,
    Format,
    format_of,
    list_recordings,
    recording_name,
)
from odisar.recordings.index import Index, default_info, describe, read_index
from odisar.recordings.labels import read_labels
from odisar.recordings.parquet_reader import read_parquet
from odisar.recordings.quality import Finding, Notes
from odisar.recordings.resampling import resample_segments
from odisar.recordings.schema import Interval, Recording
from odisar.recordings.table import Table

#: Metadata column for when a recording started, where its file has a clock.
STARTED_AT = "started_at"

_READERS: Mapping[Format, Callable[[Path, Case, Notes], Table | None]] = {
    "csv": read_csv,
    "parquet": read_parquet,
    "bag": read_bag,
}


@dataclass(frozen=True)
class ReadResult:
    """The recordings of the files without an error, by name, and everything found on the way.

    ``files`` are the names of the files by that of their recordings.
    """

    recordings: list[Recording] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    files: Mapping[str, str] = field(default_factory=dict)


def read_case(case_name: str, case: Case, root: Path) -> ReadResult:
    """Read and check every recording of a case.

    Each CSV file, Parquet file and ROS 2 bag in ``root / case.source.folder`` is a recording named
    by its stem (a bag by its folder), but for ``recordings.csv`` (metadata) and ``labels.csv``
    (labelled intervals), which may be missing. Nothing is filled, resampled or left out in
    silence. The values are (sample, channel) in the order of ``case.channels``.

    Pass the findings to ``raise_on_errors``: this function raises nothing, so that a report can
    show what was found.
    """
    shown = Path(case.source.folder)
    folder = root / shown
    folder_notes = Notes(shown.as_posix())
    paths = list_recordings(folder, case, folder_notes)
    all_notes = [folder_notes]
    read: dict[str, Recording] = {}
    for path in paths:
        notes = Notes((shown / path.name).as_posix())
        all_notes.append(notes)
        recording = _read_recording(path, case_name, case, notes)
        if recording is not None:
            read[recording.name] = recording
    files = {recording_name(path): path.name for path in paths}
    names = list(files)
    index_notes = Notes((shown / INDEX_FILE).as_posix())
    labels_notes = Notes((shown / LABELS_FILE).as_posix())
    index = _index(folder / INDEX_FILE, case_name, case, names, index_notes)
    intervals = _intervals(folder / LABELS_FILE, names, read, case, labels_notes)
    all_notes += [index_notes, labels_notes]
    recordings = [
        describe(recording, index, intervals.get(name, ()), index_notes)
        for name, recording in read.items()
    ]
    findings = [finding for notes in all_notes for finding in notes.findings]
    return ReadResult(recordings, findings, files)


def _read_recording(path: Path, case_name: str, case: Case, notes: Notes) -> Recording | None:
    """Return the recording in a file, not yet described, or None with the reasons in ``notes``."""
    table = _READERS[format_of(path)](path, case, notes)
    if table is None:
        return None
    segments = check_table(table, case, notes)
    if notes.has_errors:
        return None
    time_s = np.ascontiguousarray(table.values[:, 0])
    values = np.ascontiguousarray(table.values[:, 1:])
    if case.source.resample != "none":
        time_s, values, segments = resample_segments(
            time_s, values, segments, case.rate_hz, case.source.resample
        )
    info = default_info(case_name, case)
    if table.started_at:
        info = replace(info, extra={STARTED_AT: table.started_at})
    return Recording(
        name=recording_name(path), info=info, time_s=time_s, values=values, segments=segments
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
