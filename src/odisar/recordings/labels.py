"""Read ``labels.csv``: the labelled intervals of the recordings."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from odisar.recordings.quality import Notes
from odisar.recordings.schema import LABEL_COLUMNS, UNDISTURBED, Interval
from odisar.recordings.text_table import TextRow, read_text_table


def read_labels(
    path: Path,
    names: Sequence[str],
    spans_s: Mapping[str, tuple[float, float]],
    notes: Notes,
) -> dict[str, list[Interval]]:
    """Return the intervals by recording, in the order of the file.

    ``names`` are the recordings that have a file; ``spans_s`` gives first and last moment of
    those that could be read.
    """
    table = read_text_table(path, LABEL_COLUMNS, notes)
    if table is None:
        return {}
    for column in table.columns:
        if column not in LABEL_COLUMNS:
            notes.warning("unknown column: it is not read", "remove it", column=column, row=1)
    intervals: dict[str, list[Interval]] = {}
    files = frozenset(names)
    for row in table.rows:
        name = row.get("recording")
        if name not in files:
            notes.error(
                "labels for an unknown recording",
                f"add a recording called {name}, or remove the line",
                column="recording",
                row=row.line,
                value=name,
            )
        interval = _interval(row, notes)
        if interval is None:
            continue
        if name in spans_s:
            _check_span(interval, spans_s[name], row.line, notes)
        intervals.setdefault(name, []).append(interval)
    return intervals


def _interval(row: TextRow, notes: Notes) -> Interval | None:
    start_s = _number(row, "start_s", notes)
    end_s = _number(row, "end_s", notes)
    label = row.get("label")
    if not label:
        notes.error("the label is missing", "name the disturbance", column="label", row=row.line)
    if label == UNDISTURBED:
        notes.error(
            f"the label {UNDISTURBED!r} means undisturbed",
            "name the disturbance, or remove the line",
            column="label",
            row=row.line,
            value=label,
        )
    if start_s is None or end_s is None or not label:
        return None
    if end_s <= start_s:
        notes.error(
            "the interval ends before it starts" if end_s < start_s else "the interval is empty",
            "write end_s above start_s",
            column="end_s",
            row=row.line,
            value=row.get("end_s"),
        )
        return None
    return Interval(start_s, end_s, label)


def _number(row: TextRow, column: str, notes: Notes) -> float | None:
    text = row.get(column)
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if math.isfinite(number):
        return number
    notes.error(
        "not a number", "write seconds, as in 420.0", column=column, row=row.line, value=text
    )
    return None


def _check_span(interval: Interval, span_s: tuple[float, float], line: int, notes: Notes) -> None:
    first_s, last_s = span_s
    for column, moment_s in (("start_s", interval.start_s), ("end_s", interval.end_s)):
        # A microsecond: times are written with six decimals.
        if not first_s - 1e-6 <= moment_s <= last_s + 1e-6:
            notes.error(
                f"the interval leaves its recording, {first_s:.12g} to {last_s:.12g} s",
                "write times of the recording's own clock",
                column=column,
                row=line,
                value=f"{moment_s:.12g}",
            )
