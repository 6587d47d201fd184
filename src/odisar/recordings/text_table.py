"""Small CSV tables of text (metadata, labels), with the line number of every row."""

import csv
import io
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from odisar.recordings.csv_text import read_text
from odisar.recordings.quality import Notes


@dataclass(frozen=True)
class TextRow:
    """A row: its line number in the file and its cells by column, stripped."""

    line: int
    cells: dict[str, str]

    def get(self, column: str) -> str:
        """Return a cell, empty where the table has no such column."""
        return self.cells.get(column, "")


@dataclass(frozen=True)
class TextTable:
    """The columns and the sound rows of a table."""

    columns: tuple[str, ...]
    rows: list[TextRow]


def read_text_table(path: Path, required: Sequence[str], notes: Notes) -> TextTable | None:
    """Read a table, or None if it cannot be read or lacks a column of ``required``.

    Lines with too many or too few fields go to ``notes`` and not into the table.
    """
    text = read_text(path, notes)
    if text is None:
        return None
    lines = _lines(text, notes)
    if not lines:
        notes.error("the first line is blank", "start the file with its column names", row=1)
        return None
    header = tuple(field.strip() for field in lines[0][1])
    if not _header_is_sound(header, required, notes):
        return None
    rows = []
    for line, fields in lines[1:]:
        if len(fields) != len(header):
            few_or_many = "few" if len(fields) < len(header) else "many"
            notes.error(
                f"the line has too {few_or_many} fields",
                f"give the line {len(header)} fields",
                row=line,
                value=f"{len(fields)} fields",
            )
            continue
        cells = (field.strip() for field in fields)
        rows.append(TextRow(line, dict(zip(header, cells, strict=True))))
    return TextTable(header, rows)


def _lines(text: str, notes: Notes) -> list[tuple[int, list[str]]]:
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    lines: list[tuple[int, list[str]]] = []
    line = 1
    try:
        for fields in reader:
            if fields:
                lines.append((line, fields))
            line = reader.line_num + 1
    except csv.Error as fault:
        notes.error(
            "the line cannot be read, nor can any after it",
            "look for a quotation mark that is not closed",
            row=line,
            value=fault,
        )
    return lines


def _header_is_sound(header: Sequence[str], required: Sequence[str], notes: Notes) -> bool:
    missing = [name for name in required if name not in header]
    repeated = sorted(name for name, times in Counter(header).items() if times > 1)
    comma = "" if len(header) > 1 else "; separate the fields with commas"
    for name in missing:
        notes.error("the column is missing", f"add {name!r}{comma}", column=name, row=1)
    for name in repeated:
        notes.error("the column appears more than once", "keep one of them", column=name, row=1)
    return not missing and not repeated
