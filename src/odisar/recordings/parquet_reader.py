"""Read one Parquet file into numbers: the declared columns, by name."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from numpy.typing import NDArray
from pyarrow import compute, parquet

from odisar.config.cases import Case
from odisar.recordings.file_checks import check_file, check_size, note_unreadable
from odisar.recordings.quality import ROWS_LISTED, Notes
from odisar.recordings.table import PARQUET, Table, check_header, keep_finite

_MAGIC = b"PAR1"
_EXPORT_AGAIN = "write the file again, or remove it"

# Whole numbers beyond this are not all exact as 64-bit floats.
_EXACT = 2**53

_TO_SECONDS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def read_parquet(path: Path, case: Case, notes: Notes) -> Table | None:
    """Return the time column and the channels of a Parquet file, or None if it is none.

    Columns of integers, floats and booleans (0 and 1) are taken. A time column of timestamps
    becomes seconds since the first sample. Everything wrong with the file goes to ``notes``.
    """
    if not check_file(path, notes) or not _is_whole(path, notes):
        return None
    names = [case.source.time_column, *case.channel_names]
    try:
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            return _read(file, names, notes)
    # pyarrow's errors are of three kinds, by what it stumbles over first.
    except (OSError, ValueError, pa.ArrowException) as fault:
        reason = " ".join(str(fault).replace(str(path.parent), "").split())
        notes.error("the file is damaged", _EXPORT_AGAIN, value=reason)
        return None


def _is_whole(path: Path, notes: Notes) -> bool:
    """Return whether the file starts and ends as Parquet files do."""
    try:
        with path.open("rb") as file:
            head = file.read(4)
            size = file.seek(0, 2)
            file.seek(max(size - 4, 0))
            tail = file.read(4)
    except OSError as fault:
        note_unreadable(fault, notes)
        return False
    if not size:
        notes.error("the file is empty", "export it again, or remove it")
    elif head == tail == b"PARE":
        notes.error("the file is encrypted", "write it without encryption")
    elif head != _MAGIC:
        notes.error("the file is not Parquet", _EXPORT_AGAIN)
    elif tail != _MAGIC or size < 12:
        notes.error("the file is cut off: its end is missing", "copy or write the file again")
    else:
        return True
    return False


def _read(file: parquet.ParquetFile, names: Sequence[str], notes: Notes) -> Table | None:
    schema = file.schema_arrow
    check_header(schema.names, names, None, notes)
    readable = [name for name in dict.fromkeys(names) if _is_readable(schema, name, names, notes)]
    rows = file.metadata.num_rows
    if not check_size(rows * len(names) * 8, "table", notes):
        return None
    columns = file.read(columns=readable, use_threads=False)
    if columns.num_rows != rows:
        value = f"{columns.num_rows} rows where its end states {rows}"
        notes.error("the file is damaged", _EXPORT_AGAIN, value=value)
        return None
    lines = np.arange(1, rows + 1, dtype=np.int64)
    table = Table(
        np.full((rows, len(names)), np.nan),
        lines,
        tuple(name in readable for name in names),
        PARQUET,
    )
    for i, name in enumerate(names):
        if name not in readable:
            continue
        column = columns.column(name)
        if pa.types.is_timestamp(column.type):
            column, started_at = _seconds(column)
            table = replace(table, started_at=started_at)
        table.values[:, i] = _numbers(column, name, lines, notes)
    return table


def _is_readable(schema: pa.Schema, name: str, names: Sequence[str], notes: Notes) -> bool:
    """Return whether a column is there, once, and holds numbers (or, for time, timestamps)."""
    if schema.names.count(name) != 1:
        return False
    kind = _value_type(schema.field(name).type)
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
        return True
    is_time = name == names[0]
    if pa.types.is_timestamp(kind) and is_time:
        return True
    problem = "the column does not hold numbers"
    remedy = "write it as integers or floats"
    if pa.types.is_nested(kind):
        problem, remedy = "the column is nested", "write each of its numbers as a column"
    elif is_time:
        remedy = "write it as seconds (float64) or as timestamps"
    notes.error(problem, remedy, column=name, value=str(kind))
    return False


def _value_type(kind: pa.DataType) -> pa.DataType:
    return kind.value_type if pa.types.is_dictionary(kind) else kind


def _seconds(column: pa.ChunkedArray) -> tuple[pa.ChunkedArray, str]:
    """Return timestamps as seconds since the first known one, and that one as ISO text."""
    known = column.drop_null()
    if not len(known):
        return column.cast(pa.int64()), ""
    ticks, first = column.cast(pa.int64()), known[0]
    elapsed = compute.subtract(ticks, known[0].cast(pa.int64()))
    per_second = _TO_SECONDS[column.type.unit]
    # Whole ticks are subtracted before anything is rounded.
    return compute.divide(elapsed.cast(pa.float64(), safe=False), per_second), _iso(first)


def _iso(moment: pa.Scalar) -> str:
    zone = moment.type.tz
    text = compute.strftime(moment.cast(pa.timestamp(moment.type.unit)), "%Y-%m-%dT%H:%M:%S")
    return f"{text.as_py()}{'+00:00' if zone else ''}"  # Arrow keeps zoned timestamps in UTC


def _numbers(
    column: pa.ChunkedArray, name: str, lines: NDArray[np.int64], notes: Notes
) -> NDArray[np.float64]:
    column = column.cast(_value_type(column.type))
    _note_nulls(column, name, lines, notes)
    if pa.types.is_integer(column.type):
        _note_inexact(column, name, notes)
    known = column.is_valid().to_numpy()
    values = column.cast(pa.float64(), safe=False).to_numpy()
    numbers = np.full(len(lines), np.nan)
    numbers[known] = keep_finite(values[known], lines[known], name, PARQUET.leave_out, notes)
    return numbers


def _note_nulls(column: pa.ChunkedArray, name: str, lines: NDArray[np.int64], notes: Notes) -> None:
    nulls = lines[column.is_null().to_numpy()]
    cells = [(int(line), "null") for line in nulls[:ROWS_LISTED]]
    problem = "the value is missing"
    notes.rows(problem, PARQUET.leave_out, cells, column=name, total=len(nulls))


def _note_inexact(column: pa.ChunkedArray, name: str, notes: Notes) -> None:
    """Note whole numbers that a 64-bit float does not hold exactly."""
    inexact = compute.greater(column, _EXACT) if column.type.bit_width == 64 else None
    if inexact is None:
        return
    if pa.types.is_signed_integer(column.type):
        inexact = compute.or_(inexact, compute.less(column, -_EXACT))
    rows = np.flatnonzero(compute.fill_null(inexact, fill_value=False).to_numpy())
    cells = [(int(row) + 1, str(column[int(row)].as_py())) for row in rows[:ROWS_LISTED]]
    notes.rows(
        "the number has more digits than a 64-bit float holds",
        "subtract a constant, or write it in a larger unit",
        cells,
        column=name,
        total=len(rows),
    )
