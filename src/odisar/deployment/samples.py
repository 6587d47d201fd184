"""From a plain table of samples to recordings, by the checks that the reader makes of files."""

from collections import Counter
from collections.abc import Sequence
from numbers import Real

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.config.cases import Case
from odisar.errors import OdisarError
from odisar.recordings.checks import check_table
from odisar.recordings.quality import ROWS_LISTED, Finding, Notes
from odisar.recordings.resampling import resample_segments
from odisar.recordings.schema import Recording, RecordingInfo
from odisar.recordings.table import PARQUET, Table, closest

#: The column that names the recording of each row, where a table holds several.
RECORDING_COLUMN = "recording"
#: What the one recording of a table without that column is called.
UNNAMED = "samples"

_SHOWN = 60
_LISTED = 20
#: A table may have this many columns more than it should; the message can name what is wrong.
_SURPLUS_COLUMNS = 100

FloatArray = NDArray[np.float64]


def recordings_from_table(
    table: object, case_name: str, case: Case, max_rows: int
) -> list[Recording]:
    """Return the recordings in a table of samples, in the order in which they begin.

    The columns, in any order, are the case's time column (seconds), its channels (physical units)
    and, if need be, ``recording`` (text). Rows of a recording stand in the order of time. Rows
    are counted from 0 in messages.

    Raises
    ------
    OdisarError
        With one line for each problem: what is no table, has unknown, missing or repeated columns,
        too many rows, a cell that is no finite number, or what the reader refuses in a file.
    """
    samples = _checked_shape(table, case, max_rows)
    wanted = _sample_columns(case)
    found: list[Finding] = []
    columns = [_numbers(samples[name], name, found) for name in wanted]
    names = _recording_names(samples, case, found)
    _raise(found)
    values = np.column_stack(columns)
    rows_of: dict[str, list[int]] = {}
    for row, name in enumerate(names):
        rows_of.setdefault(name, []).append(row)
    recordings = [
        _recording(name, values[rows], np.array(rows, dtype=np.int64), case_name, case, found)
        for name, rows in rows_of.items()
    ]
    _raise(found)
    return [recording for recording in recordings if recording is not None]


def _checked_shape(table: object, case: Case, max_rows: int) -> pd.DataFrame:
    """Return the table if its columns and the number of its rows are right."""
    if not isinstance(table, pd.DataFrame):
        raise OdisarError(
            f"samples must be a table (a pandas DataFrame), not {type(table).__name__}; over HTTP "
            "send dataframe_split or dataframe_records"
        )
    wanted = _sample_columns(case)
    if len(table.columns) > len(wanted) + _SURPLUS_COLUMNS:
        raise OdisarError(
            f"the table has {len(table.columns)} columns, far more than the {len(wanted)} of the "
            f"case; send {_shown(wanted)}"
        )
    given = [str(name) for name in table.columns]
    repeated = sorted(name for name, count in Counter(given).items() if count > 1)
    if repeated:
        raise OdisarError(f"the table has the column {_shown(repeated)} more than once; keep one")
    known, present = {*wanted, RECORDING_COLUMN}, set(given)
    missing = [name for name in wanted if name not in present]
    unknown = [name for name in given if name not in known]
    if missing or unknown:
        raise OdisarError(_wrong_columns(missing, unknown, wanted))
    if len(table) == 0:
        raise OdisarError("the table has no rows; send at least one window of samples")
    if len(table) > max_rows:
        raise OdisarError(
            f"the table has {len(table)} rows, more than the {max_rows} allowed at once; send the "
            "recordings one by one, or a part of them"
        )
    return table.set_axis(given, axis="columns")


def _wrong_columns(missing: Sequence[str], unknown: Sequence[str], wanted: Sequence[str]) -> str:
    parts = [f"lacks the column {_shown(missing)}"] if missing else []
    parts += [f"has the unknown column {_shown(unknown)}"] if unknown else []
    # Comparing takes long where names are long or many.
    alike = [name for name in unknown if len(name) <= _SHOWN]
    hints = [(close, name) for name in missing[:_LISTED] if (close := closest(name, alike))]
    renames = [f"rename {_short(close)!r} to {name!r}" for close, name in hints]
    allowed = f"send {_shown(wanted)} and nothing else but {RECORDING_COLUMN!r}, which is optional"
    return f"the table {' and '.join(parts)}; {'; '.join([*renames, allowed])}"


def _sample_columns(case: Case) -> list[str]:
    return [case.source.time_column, *case.channel_names]


def _recording_names(samples: pd.DataFrame, case: Case, found: list[Finding]) -> list[str]:
    """Return (row,) the recording of every row."""
    if RECORDING_COLUMN in _sample_columns(case) or RECORDING_COLUMN not in samples:
        return [UNNAMED] * len(samples)
    cells = samples[RECORDING_COLUMN].tolist()
    wrong = [i for i, cell in enumerate(cells) if not isinstance(cell, str) or not cell.strip()]
    _note(found, RECORDING_COLUMN, "the name of the recording is no text", "give it a name", cells,
          wrong)  # fmt: skip
    return [str(cell) for cell in cells]


def _numbers(column: pd.Series, name: str, found: list[Finding]) -> FloatArray:
    """Return (row,) the finite numbers of a column; what is none goes to ``found``."""
    no_number = np.zeros(len(column), dtype=bool)
    if _holds_numbers(column):
        values = column.to_numpy(dtype=np.float64, na_value=np.nan)
    else:
        missing = column.isna().to_numpy()
        numbers = [_number(cell) for cell in column.tolist()]
        no_number = np.array([number is None for number in numbers]) & ~missing
        values = np.array([np.nan if number is None else number for number in numbers])
    for problem, remedy, wrong in (
        ("the value is no number", "send a number, without quotes", no_number),
        ("the value is missing", PARQUET.leave_out, np.isnan(values) & ~no_number),
        ("the value is infinite", PARQUET.leave_out, np.isinf(values)),
    ):
        rows = np.flatnonzero(wrong).tolist()
        cells = column.tolist() if wrong is no_number else values.tolist()
        _note(found, name, problem, remedy, cells, rows)
    return values


def _holds_numbers(column: pd.Series) -> bool:
    kinds = pd.api.types
    is_number = kinds.is_numeric_dtype(column.dtype) and not kinds.is_bool_dtype(column.dtype)
    return is_number and not kinds.is_complex_dtype(column.dtype)


def _number(cell: object) -> float | None:
    """Return a number of any kind as a float, None for anything else (text, a flag, ...)."""
    if not isinstance(cell, Real) or isinstance(cell, bool | np.bool_):
        return None
    try:
        return float(cell)
    except OverflowError:  # a whole number beyond every float
        return float("inf")


def _recording(
    name: str,
    values: FloatArray,
    rows: NDArray[np.int64],
    case_name: str,
    case: Case,
    found: list[Finding],
) -> Recording | None:
    """Return one recording, cut where the reader would cut it, or None if it has an error."""
    notes = Notes(name)
    # What the reader advises for Parquet files ("leave the row out") holds for any table.
    table = Table(values, rows, (True,) * values.shape[1], PARQUET)
    segments = check_table(table, case, notes)
    if notes.has_errors:
        found += [finding for finding in notes.findings if finding.severity == "error"]
        return None
    time_s = np.ascontiguousarray(values[:, 0])
    samples = np.ascontiguousarray(values[:, 1:])
    if case.source.resample != "none":
        time_s, samples, segments = resample_segments(
            time_s, samples, segments, case.rate_hz, case.source.resample
        )
    return Recording(name, RecordingInfo(case_name), time_s, samples, segments=segments)


def _note(
    found: list[Finding],
    column: str,
    problem: str,
    remedy: str,
    cells: Sequence[object],
    rows: Sequence[int],
) -> None:
    notes = Notes("")
    listed = [(row, _short(cells[row])) for row in rows[:ROWS_LISTED]]
    notes.rows(problem, remedy, listed, column=column, total=len(rows))
    found += notes.findings


def _raise(found: Sequence[Finding]) -> None:
    """Raise one error with a line for each of the first findings; return if there is none."""
    if not found:
        return
    lines = [_sentence(finding) for finding in found[:_LISTED]]
    if len(found) > _LISTED:
        lines.append(f"and {len(found) - _LISTED} more")
    raise OdisarError("\n".join(["the samples cannot be assessed:", *lines]))


def _sentence(finding: Finding) -> str:
    place = [f"recording {_short(finding.file)!r}"] if finding.file not in ("", UNNAMED) else []
    place += [f"column {finding.column!r}"] if finding.column else []
    place += [f"row {finding.row}"] if finding.row is not None else []
    value = f" ({_short(finding.value)})" if finding.value else ""
    where = f"{', '.join(place)}: " if place else ""
    return f"{where}{finding.problem}{value}; {finding.remedy}"


def _shown(names: Sequence[str]) -> str:
    shown = [repr(_short(name)) for name in names[:_LISTED]]
    shown += [f"{len(names) - _LISTED} more"] if len(names) > _LISTED else []
    return ", ".join(shown)


def _short(value: object) -> str:
    text = str(value)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."
