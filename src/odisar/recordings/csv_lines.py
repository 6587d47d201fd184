"""Read a CSV text line by line and say of every line what is wrong with it."""

import csv
import io
import re
from collections.abc import Iterator, Sequence

import numpy as np

from odisar.config.formats import SEPARATORS
from odisar.recordings.quality import ROWS_LISTED, Notes
from odisar.recordings.table import CSV, Table

_NOT_A_VALUE = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "#n/a"})
_INFINITE = frozenset({"inf", "infinity"})
_BLANK_LINE = "the line is blank and is not read"
_NUMBERS = {
    "point": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII),
    "comma": re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?", re.ASCII),
}


def number_pattern(decimal: str) -> re.Pattern[str]:
    """Return what a number looks like with a decimal ``point`` or ``comma``."""
    return _NUMBERS[decimal]


class _Cells:
    """The first cells, and the number of cells, that share a problem in one column."""

    def __init__(self) -> None:
        self.first: list[tuple[int, str]] = []
        self.total = 0

    def add(self, row: int, value: str) -> None:
        self.total += 1
        if len(self.first) < ROWS_LISTED:
            self.first.append((row, value))


class LineReader:
    """Reads line by line and notes what is wrong with which.

    ``separator`` is the one found in the header, ``decimal`` the sign that is declared.
    """

    def __init__(
        self,
        text: str,
        separator: str,
        header: list[str],
        names: Sequence[str],
        decimal: str,
        notes: Notes,
    ) -> None:
        self._text = text
        self._separator = separator
        self._header = header
        self._places = [header.index(name) if name in header else None for name in names]
        self._names = names
        self._decimal = decimal
        self._number = number_pattern(decimal)
        self._notes = notes
        self._problems: dict[tuple[str, str, str], _Cells] = {}

    def read(self, present: tuple[bool, ...]) -> Table:
        """Return the numbers of all lines, NaN where there is none."""
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
        return Table(
            np.array(values, dtype=np.float64).reshape(shape),
            np.array(lines, dtype=np.int64),
            present,
            CSV,
        )

    def _records(self) -> Iterator[tuple[int, list[str]]]:
        sign = SEPARATORS[self._separator]
        reader = csv.reader(io.StringIO(self._text, newline=""), delimiter=sign, strict=True)
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
                np.nan if place is None else self._parse(row, name, fields[place])
                for name, place in zip(self._names, self._places, strict=True)
            ]
        remedy = f"give the line {len(self._header)} fields"
        if surplus >= len(self._header) - 1 and self._separator == "comma":
            remedy += "; write numbers with a point (0.5) if they have decimal commas"
            remedy += ", or put semicolons between fields and declare both under source.csv"
        problem = "the line has too many fields" if surplus > 0 else "the line has too few fields"
        self._note("", problem, remedy, row, f"{len(fields)} fields")
        return [np.nan] * len(self._names)

    def _parse(self, row: int, name: str, cell: str) -> float:
        stripped = cell.strip()
        if self._number.fullmatch(stripped):
            number = float(stripped.replace(",", "."))
            if np.isfinite(number):
                return number
        problem, remedy = self._cell_problem(stripped)
        self._note(name, problem, remedy, row, cell)
        return np.nan

    def _cell_problem(self, cell: str) -> tuple[str, str]:
        lowered = cell.lower()
        if lowered in _NOT_A_VALUE:
            return "the value is missing", CSV.leave_out
        if lowered.lstrip("+-") in _INFINITE or self._number.fullmatch(cell):
            return "the value is infinite", CSV.leave_out
        other = "comma" if self._decimal == "point" else "point"
        if number_pattern(other).fullmatch(cell):
            return f"the number has a decimal {other}", self._decimal_remedy(other)
        return "the value is not a number", "write a number, or leave the whole line out"

    def _decimal_remedy(self, other: str) -> str:
        example = "0.5" if self._decimal == "point" else "0,5"
        remedy = f"write it with a {self._decimal} ({example})"
        if other == "comma" and self._separator == "comma":
            return remedy
        return f"{remedy}, or declare source.csv.decimal: {other} for the case"

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
