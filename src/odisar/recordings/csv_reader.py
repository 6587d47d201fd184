"""Read one CSV file into numbers: at once where it is clean, line by line where it is not."""

import csv
import difflib
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from numpy.typing import NDArray
from pyarrow import csv as arrow_csv

from odisar.recordings.quality import ROWS_LISTED, Notes

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?", re.ASCII)
_NOT_A_VALUE = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "#n/a"})
_INFINITE = frozenset({"inf", "infinity"})
_BLANK_LINE = "the line is blank and is not read"
_SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars"}


@dataclass(frozen=True)
class Columns:
    """The declared columns of a file.

    ``values`` is (row, column), NaN where a cell is missing or no number (each is in the notes);
    ``lines`` (row,) are the line numbers of the rows; ``present`` the columns the file has.
    """

    values: NDArray[np.float64]
    lines: NDArray[np.int64]
    present: tuple[bool, ...]


def read_columns(text: str, names: Sequence[str], notes: Notes) -> Columns | None:
    """Return the columns called ``names`` of a CSV text, or None if not even its header is there.

    Everything wrong with the text goes to ``notes``.
    """
    separator = _separator(text, names, notes)
    header = _header(text, separator, notes)
    if header is None:
        return None
    present = _check_header(header, names, notes)
    if separator == "," and all(present) and len(set(header)) == len(header):
        columns = _read_clean(text, names)
        if columns is not None:
            return columns
    return _LineReader(text, separator, header, names, notes).read(present)


def _first_line(text: str) -> str:
    return re.split(r"\r\n|\n|\r", text, maxsplit=1)[0]


def _separator(text: str, names: Sequence[str], notes: Notes) -> str:
    """Return the separator of the header line: a comma, or another that explains the line."""
    line = _first_line(text)
    for separator, word in _SEPARATORS.items():
        fields = [field.strip().strip('"') for field in line.split(separator)]
        if len(fields) > 1 and len(set(names) & set(fields)) > len(set(names)) // 2:
            notes.error(
                f"fields are separated by {word}",
                "save the file with commas between fields and points in numbers (0.5)",
                row=1,
                value=line,
            )
            return separator
    return ","


def _header(text: str, separator: str, notes: Notes) -> list[str] | None:
    try:
        header = next(csv.reader([_first_line(text)], delimiter=separator, strict=True))
    except (csv.Error, StopIteration) as fault:
        problem = "the header line cannot be read"
        notes.error(problem, "start the file with the names of its columns", row=1, value=fault)
        return None
    if not header:
        notes.error("the first line is blank", "start the file with its column names", row=1)
        return None
    if all(_NUMBER.fullmatch(field.strip()) for field in header):
        notes.error(
            "the header line is missing",
            "start the file with the names of its columns",
            row=1,
            value=_first_line(text),
        )
        return None
    return header


def _check_header(header: list[str], names: Sequence[str], notes: Notes) -> tuple[bool, ...]:
    """Log missing, repeated and extra columns; return which of ``names`` are there."""
    for name in names:
        if name not in header:
            folded = {field.strip().casefold(): field for field in header if field not in names}
            close = difflib.get_close_matches(name.casefold(), folded, n=1, cutoff=0.7)
            hint = f"rename {folded[close[0]]!r} to {name!r}" if close else f"add {name!r}"
            notes.error("the column is missing", f"{hint}, or change the case", column=name, row=1)
    for field in sorted(set(header)):
        times = header.count(field)
        if times > 1:
            notes.error(
                "the column appears more than once",
                "keep one of them",
                column=field,
                row=1,
                value=f"{times} times",
            )
        if field not in names:
            notes.warning(
                "the column is not declared and is not read",
                "add it to the case's channels to use it",
                column=field,
                row=1,
            )
    return tuple(name in header for name in names)


def _read_clean(text: str, names: Sequence[str]) -> Columns | None:
    """Return the columns if every line and every number is sound, else None."""
    try:
        table = arrow_csv.read_csv(
            pa.BufferReader(text.encode()),
            read_options=arrow_csv.ReadOptions(use_threads=False),
            parse_options=arrow_csv.ParseOptions(ignore_empty_lines=False),
            convert_options=arrow_csv.ConvertOptions(
                include_columns=list(dict.fromkeys(names)),
                column_types=dict.fromkeys(names, pa.float64()),
                null_values=[],
            ),
        )
    except pa.ArrowInvalid:
        return None
    values = np.column_stack([table.column(name).to_numpy() for name in names])
    if not np.isfinite(values).all():
        return None
    lines = np.arange(2, len(values) + 2, dtype=np.int64)
    return Columns(values, lines, (True,) * len(names))


class _Cells:
    """The first cells, and the number of cells, that share a problem in one column."""

    def __init__(self) -> None:
        self.first: list[tuple[int, str]] = []
        self.total = 0

    def add(self, row: int, value: str) -> None:
        self.total += 1
        if len(self.first) < ROWS_LISTED:
            self.first.append((row, value))


class _LineReader:
    """Reads line by line and notes what is wrong with which."""

    def __init__(
        self,
        text: str,
        separator: str,
        header: list[str],
        names: Sequence[str],
        notes: Notes,
    ) -> None:
        self._text = text
        self._separator = separator
        self._header = header
        self._places = [header.index(name) if name in header else None for name in names]
        self._names = names
        self._notes = notes
        self._problems: dict[tuple[str, str, str], _Cells] = {}

    def read(self, present: tuple[bool, ...]) -> Columns:
        values: list[list[float]] = []
        lines: list[int] = []
        blank: list[int] = []
        for row, fields in self._records():
            if not fields:
                blank.append(row)
                continue
            # Only blank lines inside the data are worth a word, not those after its end.
            for skipped in blank:
                self._note("", _BLANK_LINE, "remove it", skipped, "")
            blank.clear()
            lines.append(row)
            values.append(self._numbers(row, fields))
        self._report()
        shape = (len(values), len(self._names))
        return Columns(
            np.array(values, dtype=np.float64).reshape(shape),
            np.array(lines, dtype=np.int64),
            present,
        )

    def _records(self) -> Iterator[tuple[int, list[str]]]:
        reader = csv.reader(
            io.StringIO(self._text, newline=""), delimiter=self._separator, strict=True
        )
        row = 1
        try:
            for fields in reader:
                if row > 1:
                    yield row, fields
                row = reader.line_num + 1
        except csv.Error as fault:
            self._notes.error(
                "the line cannot be read, nor can any after it",
                "look for a quotation mark that is not closed",
                row=row,
                value=fault,
            )

    def _numbers(self, row: int, fields: list[str]) -> list[float]:
        surplus = len(fields) - len(self._header)
        if surplus == 0:
            return [
                np.nan if place is None else self._number(row, name, fields[place])
                for name, place in zip(self._names, self._places, strict=True)
            ]
        remedy = f"give the line {len(self._header)} fields"
        if surplus >= len(self._header) - 1:
            remedy += "; write numbers with a point (0.5) if they have decimal commas"
        problem = "the line has too many fields" if surplus > 0 else "the line has too few fields"
        self._note("", problem, remedy, row, f"{len(fields)} fields")
        return [np.nan] * len(self._names)

    def _number(self, row: int, name: str, cell: str) -> float:
        stripped = cell.strip()
        if _NUMBER.fullmatch(stripped):
            number = float(stripped)
            if np.isfinite(number):
                return number
        problem, remedy = _cell_problem(stripped)
        self._note(name, problem, remedy, row, cell)
        return np.nan

    def _note(self, column: str, problem: str, remedy: str, row: int, value: str) -> None:
        self._problems.setdefault((column, problem, remedy), _Cells()).add(row, value)

    def _report(self) -> None:
        for (column, problem, remedy), cells in self._problems.items():
            self._notes.rows(
                problem,
                remedy,
                cells.first,
                column=column,
                total=cells.total,
                severity="warning" if problem == _BLANK_LINE else "error",
            )


def _cell_problem(cell: str) -> tuple[str, str]:
    lowered = cell.lower()
    if lowered in _NOT_A_VALUE:
        return "the value is missing", "leave the whole line out: a missing sample is a gap"
    if lowered.lstrip("+-") in _INFINITE or _NUMBER.fullmatch(cell):
        return "the value is infinite", "leave the whole line out: a missing sample is a gap"
    if _DECIMAL_COMMA.fullmatch(cell):
        return "the number has a decimal comma", "write it with a point (0.5)"
    return "the value is not a number", "write a number, or leave the whole line out"
