"""Read ``recordings.csv``: what is known about each recording besides its samples."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from odisar.config.cases import Case
from odisar.recordings.quality import Notes
from odisar.recordings.schema import (
    INDEX_COLUMNS,
    SPLITS,
    UNDISTURBED,
    Interval,
    Recording,
    RecordingInfo,
)
from odisar.recordings.text_table import TextRow, TextTable, read_text_table

_FITTED_SPLITS = frozenset({"train", "validation", "calibration"})


@dataclass(frozen=True)
class Index:
    """Metadata by recording, and the line of ``recordings.csv`` that each comes from."""

    infos: Mapping[str, RecordingInfo]
    lines: Mapping[str, int]


def read_index(
    path: Path, case_name: str, case: Case, names: Sequence[str], notes: Notes
) -> Index | None:
    """Read the metadata of the recordings called ``names``, or None without a usable table.

    Columns without a meaning of their own are kept in ``RecordingInfo.extra``.
    """
    required = ["recording", "split"] if case.splits.kind == "metadata" else ["recording"]
    table = read_text_table(path, required, notes)
    if table is None:
        return None
    rows = _rows_by_name(table, names, notes)
    if case.splits.kind == "fractions" and any(row.get("split") for row in rows.values()):
        notes.warning(
            "the column is not used: splits.kind=fractions draws the splits",
            "use splits.kind=metadata to take them from here",
            column="split",
        )
    extra = [column for column in table.columns if column not in INDEX_COLUMNS]
    infos = {name: _info(row, case_name, case, extra, notes) for name, row in rows.items()}
    return Index(infos, {name: row.line for name, row in rows.items()})


def _rows_by_name(table: TextTable, names: Sequence[str], notes: Notes) -> dict[str, TextRow]:
    """Return the rows that belong to a file; note the others and the files without a row."""
    rows: dict[str, TextRow] = {}
    files = frozenset(names)
    for row in table.rows:
        name = row.get("recording")
        note = partial(notes.error, column="recording", row=row.line, value=name)
        if name in rows:
            first = rows[name].line
            note("the recording has two rows", f"keep this or row {first}")
        elif name not in files:
            note("the row has no file", f"add a recording called {name}, or remove the row")
        else:
            rows[name] = row
    for name in names:
        if name not in rows:
            notes.error(
                "the file has no row", "add a row, or remove the file", column="recording",
                value=name,
            )  # fmt: skip
    return rows


def default_info(case_name: str, case: Case) -> RecordingInfo:
    """Return what holds for a recording of which nothing is written."""
    split = "cross-fit" if case.splits.kind == "cross-fit" else "test"
    return RecordingInfo(case=case_name, split=split)


def _info(
    row: TextRow, case_name: str, case: Case, extra: Sequence[str], notes: Notes
) -> RecordingInfo:
    return replace(
        default_info(case_name, case),
        maneuver=row.get("maneuver"),
        variant=row.get("variant"),
        disturbance=row.get("disturbance") or UNDISTURBED,
        components=row.get("components") or UNDISTURBED,
        strength=_strength(row, notes),
        base_seed=row.get("base_seed"),
        split=_split(row, case, notes),
        fold=_fold(row, case, notes),
        extra={column: row.get(column) for column in extra},
    )


def _strength(row: TextRow, notes: Notes) -> float | None:
    text = row.get("strength")
    if not text:
        return None
    try:
        strength = float(text)
    except ValueError:
        strength = math.nan
    if math.isfinite(strength):
        return strength
    notes.error(
        "not a number", "write a number, or leave it blank", column="strength", row=row.line,
        value=text,
    )  # fmt: skip
    return None


def _fold(row: TextRow, case: Case, notes: Notes) -> int | None:
    text = row.get("fold")
    if not text:
        return None
    if text.isascii() and text.isdigit() and int(text) < (case.splits.folds or math.inf):
        return int(text)
    last = "" if case.splits.folds is None else f" below splits.folds={case.splits.folds}"
    notes.error(
        "not a fold", f"write a whole number from 0{last}, or leave it blank", column="fold",
        row=row.line, value=text,
    )  # fmt: skip
    return None


def _split(row: TextRow, case: Case, notes: Notes) -> str:
    default = default_info("", case).split
    text = row.get("split")
    if not text and case.splits.kind != "metadata":
        return default
    allowed = [split for split in SPLITS if split != "cross-fit" or case.splits.kind == split]
    if text in allowed:
        return text
    known = ", ".join(allowed)
    remedy = f"write one of {known}"
    if text == "cross-fit":
        remedy += ", or set splits.kind to cross-fit"
    notes.error("unknown split", remedy, column="split", row=row.line, value=text)
    return default


def describe(
    recording: Recording, index: Index | None, intervals: Sequence[Interval], notes: Notes
) -> Recording:
    """Return the recording with its labels and, if there is an index, its metadata.

    Without an index a labelled recording takes its first label as its disturbance. With one,
    labels and metadata must not contradict each other.
    """
    labelled = replace(recording, intervals=tuple(intervals))
    if index is None:
        if not intervals:
            return labelled
        others = sorted({interval.label for interval in intervals[1:]} - {intervals[0].label})
        if others:
            notes.warning(
                f"the recording counts as {intervals[0].label!r}, its first label, as a whole",
                "cut it into recordings with one kind of disturbance each, or accept it",
                column="label",
                value=", ".join(others),
            )
        info = replace(recording.info, disturbance=intervals[0].label, components="all")
        return replace(labelled, info=info)
    info = index.infos.get(recording.name, recording.info)
    info = replace(info, extra={**recording.info.extra, **info.extra})
    line = index.lines.get(recording.name)
    error = partial(notes.error, column="disturbance", row=line, value=recording.name)
    warning = partial(notes.warning, column="disturbance", row=line, value=recording.name)
    if line is not None and intervals and not info.is_disturbed:
        error(
            f"labels.csv labels a recording with disturbance={UNDISTURBED}",
            "name its disturbance here, or remove its labels",
        )
    if info.is_disturbed and not intervals:
        warning(
            "the recording is disturbed but has no label",
            "label the disturbed intervals in labels.csv",
        )
    if info.is_disturbed and info.split in _FITTED_SPLITS:
        warning(
            f"a disturbed recording in split {info.split} becomes part of what is normal",
            "move it to development or test, unless it is meant to be normal",
        )
    return replace(labelled, info=info)
