"""Read one CSV file into numbers: at once where it is clean, line by line where it is not."""

import csv
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from pyarrow import csv as arrow_csv

from odisar.config.cases import Case
from odisar.config.formats import SEPARATORS, CsvFormat
from odisar.recordings.csv_lines import LineReader, number_pattern
from odisar.recordings.csv_text import read_text
from odisar.recordings.quality import Notes
from odisar.recordings.table import CSV, Table, check_header

_BLANKS = re.compile(r"[ \t]+")
_BLANKS_AT_ENDS = re.compile(r"\A | \Z|(?<=[\r\n]) | (?=[\r\n])")

# Names of separators (``CsvFormat.separator``), as they are found in a header line.
_WORDS = {
    "comma": "commas",
    "semicolon": "semicolons",
    "tab": "tabs",
    "bar": "bars",
    "space": "spaces",
}


def read_csv(path: Path, case: Case, notes: Notes) -> Table | None:
    """Return the time column and the channels of a CSV file, or None if it has not even a header.

    Everything wrong with the file goes to ``notes``.
    """
    text = read_text(path, notes)
    if text is None:
        return None
    return read_columns(
        text, [case.source.time_column, *case.channel_names], case.source.csv, notes
    )


def read_columns(text: str, names: Sequence[str], layout: CsvFormat, notes: Notes) -> Table | None:
    """Return the columns called ``names`` of a CSV text, or None if not even its header is there.

    Where fields are separated by blanks, any run of spaces and tabs separates, and those at the
    ends of a line do not count.
    """
    separator = _separator(_first_line(text), names, layout, notes)
    sign = SEPARATORS[separator]
    if separator == "space":
        text = _single_blanks(text)
    header = _header(text, sign, layout, notes)
    if header is None:
        return None
    present = check_header(header, names, CSV.header_row, notes)
    sound = separator == layout.separator and all(present) and len(set(header)) == len(header)
    if sound:
        columns = _read_clean(text, names, layout)
        if columns is not None:
            return columns
    return LineReader(text, separator, header, names, layout.decimal, notes).read(present)


def _first_line(text: str) -> str:
    return re.split(r"\r\n|\n|\r", text, maxsplit=1)[0]


def _single_blanks(text: str) -> str:
    return _BLANKS_AT_ENDS.sub("", _BLANKS.sub(" ", text))


def _separator(line: str, names: Sequence[str], layout: CsvFormat, notes: Notes) -> str:
    """Return the separator of the header line: the declared one, or another that explains it."""
    declared = layout.separator
    if _explains(declared, line, names):
        return declared
    for separator, word in _WORDS.items():
        if separator != declared and _explains(separator, line, names):
            notes.error(
                f"fields are separated by {word}",
                f"declare source.csv.separator: {separator} for the case, or save the file with "
                f"{_WORDS[declared]} between fields and {_decimals(layout)}",
                row=1,
                value=line,
            )
            return separator
    return declared


def _explains(separator: str, line: str, names: Sequence[str]) -> bool:
    """Return whether most of ``names`` are fields of the line, cut at the separator."""
    parts = line.split() if separator == "space" else line.split(SEPARATORS[separator])
    fields = {part.strip().strip('"') for part in parts}
    return len(fields) > 1 and len(set(names) & fields) > len(set(names)) // 2


def _decimals(layout: CsvFormat) -> str:
    points = layout.decimal == "point"
    return "points in numbers (0.5)" if points else "commas in numbers (0,5)"


def _header(text: str, sign: str, layout: CsvFormat, notes: Notes) -> list[str] | None:
    line = _first_line(text)
    try:
        header = next(csv.reader([line], delimiter=sign, strict=True))
    except (csv.Error, StopIteration) as fault:
        problem = "the header line cannot be read"
        notes.error(problem, "start the file with the names of its columns", row=1, value=fault)
        return None
    if not header:
        notes.error("the first line is blank", "start the file with its column names", row=1)
        return None
    number = number_pattern(layout.decimal)
    if all(number.fullmatch(field.strip()) for field in header):
        notes.error(
            "the header line is missing",
            "start the file with the names of its columns",
            row=1,
            value=line,
        )
        return None
    return header


def _read_clean(text: str, names: Sequence[str], layout: CsvFormat) -> Table | None:
    """Return the columns if every line and every number is sound, else None."""
    try:
        table = arrow_csv.read_csv(
            pa.BufferReader(text.encode()),
            read_options=arrow_csv.ReadOptions(use_threads=False),
            parse_options=arrow_csv.ParseOptions(
                delimiter=layout.separator_sign, ignore_empty_lines=False
            ),
            convert_options=arrow_csv.ConvertOptions(
                include_columns=list(dict.fromkeys(names)),
                column_types=dict.fromkeys(names, pa.float64()),
                null_values=[],
                decimal_point=layout.decimal_sign,
            ),
        )
    except pa.ArrowInvalid:
        return None
    values = np.column_stack([table.column(name).to_numpy() for name in names])
    if not np.isfinite(values).all():
        return None
    # A quoted field with line breaks: only the line reader knows on which line each record is.
    if len(text.splitlines()) != len(values) + 1:
        return None
    lines = np.arange(2, len(values) + 2, dtype=np.int64)
    return Table(values, lines, (True,) * len(names), CSV)
