"""What every reader makes of a file: the declared columns as numbers, and the row of each."""

import difflib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from odisar.recordings.quality import ROWS_LISTED, Notes, Severity

_TOPICS_LISTED = 20
_COLUMNS_LISTED = 5


@dataclass(frozen=True)
class Advice:
    """The way out of what is wrong with samples, in the words of the format they came in."""

    leave_out: str
    outside: str
    repeated: str
    backward: str
    header_row: int | None


CSV: Final = Advice(
    leave_out="leave the whole line out: a missing sample is a gap",
    outside="mend the value, leave the line out",
    repeated="remove one of the two lines",
    backward="sort the lines by time",
    header_row=1,
)
PARQUET: Final = Advice(
    leave_out="leave the whole row out: a missing sample is a gap",
    outside="mend the value, leave the row out",
    repeated="remove one of the two rows",
    backward="sort the rows by time",
    header_row=None,
)
BAG: Final = Advice(
    leave_out="trim the bag, or export it to Parquet without the row: a missing sample is a gap",
    outside="check the sensor, trim the bag",
    repeated="set source.bag.stamp: received, or mend the node that sends a message twice",
    backward="cut the bag where the clock jumped, or set source.bag.stamp: received",
    header_row=None,
)


@dataclass(frozen=True)
class Table:
    """The declared columns of a file, of which the first is time in seconds.

    ``values`` is (row, column), NaN where a cell is missing or no number (each is in the notes);
    ``lines`` (row,) are the numbers of the rows as the file counts them: lines of a CSV file, the
    header included; rows of a Parquet file; messages of a bag's stamp topic. ``present`` says
    which columns the file has, ``started_at`` when it started on a clock, if it says so.
    """

    values: NDArray[np.float64]
    lines: NDArray[np.int64]
    present: tuple[bool, ...]
    advice: Advice
    started_at: str = ""


def check_header(
    header: Sequence[str], names: Sequence[str], row: int | None, notes: Notes
) -> tuple[bool, ...]:
    """Log missing, repeated and extra columns; return which of ``names`` are there."""
    for name in names:
        if name not in header:
            close = closest(name, (field for field in header if field not in names))
            hint = f"rename {close!r} to {name!r}" if close else f"add {name!r}"
            problem = "the column is missing"
            notes.error(problem, f"{hint}, or change the case", column=name, row=row)
    counts = Counter(header)
    for field, times in sorted(counts.items()):
        if times > 1:
            notes.error(
                "the column appears more than once",
                "keep one of them",
                column=field,
                row=row,
                value=f"{times} times",
            )
    _note_undeclared(sorted(counts.keys() - set(names)), row, notes)
    return tuple(name in counts for name in names)


def _note_undeclared(fields: Sequence[str], row: int | None, notes: Notes) -> None:
    problem = "the column is not declared and is not read"
    remedy = "add it to the case's channels to use it"
    for field in fields[:_COLUMNS_LISTED]:
        notes.warning(problem, remedy, column=field, row=row)
    rest = len(fields) - _COLUMNS_LISTED
    if rest > 0:
        notes.warning(problem, remedy, row=row, value=f"and {rest:,} more")


def closest(name: str, candidates: Iterable[str]) -> str | None:
    """Return the candidate that ``name`` is most likely a misspelling of, if any."""
    folded = {candidate.strip().casefold(): candidate for candidate in candidates}
    close = difflib.get_close_matches(name.casefold(), folded, n=1, cutoff=0.7)
    return folded[close[0]] if close else None


def listed(names: Sequence[str]) -> str:
    """Return names for a message, the first of many and the number of the others."""
    rest = len(names) - _TOPICS_LISTED
    return ", ".join(names[:_TOPICS_LISTED]) + (f" and {rest} more" if rest > 0 else "")


def note_rows(
    notes: Notes,
    severity: Severity,
    column: str,
    problem: str,
    remedy: str,
    lines: NDArray[np.int64],
    values: NDArray[np.float64],
) -> None:
    """Note one problem of the rows numbered ``lines`` (row,) with ``values`` (row,)."""
    cells = [
        (int(line), f"{value:.12g}")
        for line, value in zip(lines[:ROWS_LISTED], values[:ROWS_LISTED], strict=True)
    ]
    notes.rows(problem, remedy, cells, column=column, severity=severity, total=len(lines))


def keep_finite(
    values: NDArray[np.float64],
    lines: NDArray[np.int64],
    column: str,
    remedy: str,
    notes: Notes,
) -> NDArray[np.float64]:
    """Return (row,) values with NaN for what is infinite; note that, and what is NaN."""
    for wrong, problem in (
        (np.isnan(values), "the value is missing"),
        (np.isinf(values), "the value is infinite"),
    ):
        if wrong.any():
            note_rows(notes, "error", column, problem, remedy, lines[wrong], values[wrong])
    return np.where(np.isfinite(values), values, np.nan)
