"""Find out how a CSV file is written: encoding, separator, decimal sign, header, units."""

import codecs
import csv
import io
import warnings
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from odisar.config.formats import CsvFormat
from odisar.proposals.samples import HEAD_BYTES, Sample, UnusableError
from odisar.recordings.csv_lines import number_pattern

_LAYOUTS = tuple(
    CsvFormat(separator=separator, decimal=decimal)
    for decimal in ("point", "comma")
    for separator in ("comma", "semicolon", "tab", "bar", "space")
    if not separator == decimal == "comma"
)
_LINES_LOOKED_AT = 80
_MISSING = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "#n/a"})
_NUMERIC_SHARE = 0.5


class _Shape(NamedTuple):
    """How well a layout explains the first lines; compared from the first field on."""

    score: float
    columns: int
    header_line: int
    layout: CsvFormat


def sniff_csv(path: Path) -> Sample:
    """Return the start of a CSV file.

    Raises
    ------
    UnusableError
        If it is empty, binary or unreadable, or has no header or no table.
    """
    raw, whole = _head(path)
    text, encoding = _decode(raw, whole=whole)
    lines = [line for line in text.splitlines()[:_LINES_LOOKED_AT] if line.strip()]
    shape = max((_shape(lines, layout) for layout in _LAYOUTS), key=lambda item: item[:2])
    if shape.columns < 2:
        raise UnusableError(
            "no table of at least two columns with numbers could be made out (tried commas, "
            "semicolons, tabs, bars and blanks between fields): export it as CSV with a line of "
            "column names first"
        )
    header = _fields(lines[shape.header_line], shape.layout)
    body = [_fields(line, shape.layout) for line in lines[shape.header_line + 1 :]]
    has_units = _is_units_row(body, shape.layout)
    units = dict(zip(header, (cell.strip(" []()") for cell in body[0]), strict=False))
    skipped = shape.header_line + 1 + has_units
    table = _table(text, header, skipped, shape.layout)
    obstacles: dict[str, str] = {}
    if encoding not in ("utf-8", "utf-8-sig"):
        obstacles["encoding"] = f"it is encoded in {encoding}, not UTF-8"
    if shape.header_line:
        obstacles["preamble"] = f"{shape.header_line} line(s) stand before the column names"
    if has_units:
        obstacles["units"] = "its second line holds units: " + shape.layout.separator_sign.join(
            body[0]
        )
    return Sample(
        path,
        table,
        layout=shape.layout,
        encoding=encoding,
        header_line=shape.header_line,
        units=units if has_units else {},
        obstacles=obstacles,
        remarks=(
            *_column_remarks(header),
            *(() if whole else (f"only its first {HEAD_BYTES // 1024**2} MiB were looked at",)),
        ),
    )


def _head(path: Path) -> tuple[bytes, bool]:
    """Return the first bytes of a file, and whether they are all."""
    if path.is_dir():
        raise UnusableError("it is a folder, not a file")
    try:
        with path.open("rb") as file:
            raw = file.read(HEAD_BYTES)
            whole = not file.read(1)
    except OSError as fault:
        raise UnusableError(f"it cannot be read ({fault.strerror})") from fault
    if not raw.strip(codecs.BOM_UTF8 + b" \t\r\n"):
        raise UnusableError("it is empty")
    return raw, whole


def _decode(raw: bytes, *, whole: bool) -> tuple[str, str]:
    """Return text without a last line that is cut off, and the name of its encoding."""
    encoding = "utf-8-sig"
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encoding = "utf-16"
    elif b"\0" in raw:
        raise UnusableError("it is binary, not text")
    if not whole and encoding != "utf-16":
        raw = raw[: raw.rfind(b"\n") + 1] or raw
    try:
        text = raw.decode(encoding, errors="replace" if encoding == "utf-16" else "strict")
    except UnicodeDecodeError:
        encoding = "cp1252"
        text = raw.decode(encoding, errors="replace")
    controls = sum(ord(sign) < 32 and sign not in "\t\r\n\f" for sign in text[:4096])
    if controls > 40:
        raise UnusableError("it is binary, not text")
    return text, encoding


def _fields(line: str, layout: CsvFormat) -> list[str]:
    """Return the fields of a line; a separator at its end makes no field."""
    if layout.separator == "space":
        return line.split()
    try:
        fields = next(csv.reader([line], delimiter=layout.separator_sign))
    except (csv.Error, StopIteration):
        return [line]
    return fields[:-1] if len(fields) > 1 and not fields[-1].strip() else fields


def _shape(lines: list[str], layout: CsvFormat) -> _Shape:
    """Return how well a layout explains the lines: the share of cells that become numbers."""
    rows = [_fields(line, layout) for line in lines]
    counts = Counter(len(row) for row in rows)
    columns = max(counts, key=lambda count: (counts[count], count)) if counts else 0
    if columns < 2:
        return _Shape(0.0, 0, 0, layout)
    header = next((i for i, row in enumerate(rows) if len(row) == columns), 0)
    body = [row for row in rows[header + 1 :] if len(row) == columns]
    if not body:
        return _Shape(0.0, 0, 0, layout)
    cells = [cell for row in body for cell in row]
    numeric = sum(_is_number(cell, layout) for cell in cells) / len(cells)
    fitting = len(body) / max(len(rows) - header - 1, 1)
    # A comma that is a decimal sign is no separator: wrongly cut numbers are numbers as well.
    quoted_whole = not _cuts_numbers(lines[header + 1 :], layout)
    return _Shape(round(numeric * fitting, 3) * quoted_whole, columns, header, layout)


def _cuts_numbers(lines: list[str], layout: CsvFormat) -> bool:
    """Return whether commas stand inside of fields that another sign separates."""
    if layout.separator != "comma":
        return False
    for sign in ";\t|":
        with_sign = [line for line in lines if line.count(sign) >= 1]
        if len(with_sign) > len(lines) // 2:
            return True
    return False


def _is_number(cell: str, layout: CsvFormat) -> bool:
    return bool(number_pattern(layout.decimal).fullmatch(cell.strip()))


def _is_units_row(body: list[list[str]], layout: CsvFormat) -> bool:
    """Return whether the line after the header holds no number while the next one does."""
    if len(body) < 2 or any(_is_number(cell, layout) for cell in body[0]):
        return False
    named = sum(bool(cell.strip()) for cell in body[0])
    return named > 0 and any(
        _is_number(cell, layout) and below.strip()
        for cell, below in zip(body[1], body[0], strict=False)
    )


def _table(text: str, header: list[str], skipped: int, layout: CsvFormat) -> pd.DataFrame:
    """Return the columns below the header: floats where most cells are numbers, else text."""
    if all(_is_number(name, layout) for name in header):
        raise UnusableError(
            "it has no line of column names: write one, as in "
            + layout.separator_sign.join(["time_s", *(f"x{i}" for i in range(1, len(header)))][:4])
        )
    blank = "".join(line for line in text.splitlines(keepends=True) if line.strip())
    options: dict[str, Any] = (
        {"sep": r"\s+"} if layout.separator == "space" else {"sep": layout.separator_sign}
    )
    # One more name than fields takes what a separator at the end of lines adds.
    try:
        with warnings.catch_warnings():  # of lines that are too long: the quality check names them
            warnings.simplefilter("ignore", pd.errors.ParserWarning)
            cells = pd.read_csv(
                io.StringIO(blank),
                header=None,
                names=list(range(len(header) + 1)),
                index_col=False,
                skiprows=skipped,
                dtype=str,
                keep_default_na=False,
                on_bad_lines="skip",
                engine="c",
                **options,
            ).iloc[:, : len(header)]
    except pd.errors.ParserError as fault:
        reason = " ".join(str(fault).split())
        raise UnusableError(
            f"its lines cannot be told apart ({reason}): close every quote"
        ) from fault
    if cells.empty:
        raise UnusableError("it has no samples below its header")
    columns = {i: _column(cells[i], layout) for i in range(len(header))}
    table = pd.DataFrame(columns)
    table.columns = pd.Index(header)
    kept = [i for i, name in enumerate(header) if name.strip() and name not in header[:i]]
    return table.iloc[:, kept]


def _column(cells: "pd.Series[str]", layout: CsvFormat) -> "pd.Series[Any]":
    """Return a column as floats if most of its cells with a value are numbers, else as text."""
    text = cells.fillna("").str.strip()
    known = ~text.str.lower().isin(_MISSING)
    plain = text.str.replace(layout.decimal_sign, ".") if layout.decimal == "comma" else text
    numbers = pd.to_numeric(plain.where(known), errors="coerce").astype(float)
    if known.any() and numbers[known].notna().mean() < _NUMERIC_SHARE:
        return text
    return numbers


def _column_remarks(header: list[str]) -> tuple[str, ...]:
    remarks = []
    repeated = sorted(name for name, count in Counter(header).items() if count > 1 and name)
    if repeated:
        remarks.append(f"it has more than one column called {', '.join(repeated)}")
    if any(not name.strip() for name in header):
        remarks.append("it has a column without a name")
    blanks = [name for name in header if name != name.strip()]
    if blanks:
        remarks.append(f"blanks stand around the column names {blanks}")
    return tuple(remarks)
