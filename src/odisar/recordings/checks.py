"""Checks of one file's numbers: its time stamps, its ranges, and whether anything moves at all."""

import itertools

import numpy as np
from numpy.typing import NDArray

from odisar.config.cases import Case, Channel
from odisar.recordings.csv_reader import Columns
from odisar.recordings.quality import ROWS_LISTED, Notes, Severity

#: A measured rate this far from the declared one is another rate, not a drifting clock.
RATE_TOLERANCE = 0.01

# Beyond this the median step is not one period: counting samples by rounding would hide it.
_MEDIAN_TOLERANCE = 0.25

_UNIT_SHARE = 0.05

Segments = tuple[tuple[int, int], ...]


def check_columns(columns: Columns, case: Case, notes: Notes) -> Segments:
    """Check a file whose first column is time and whose others are the case's channels.

    Returns the half-open sample ranges between gaps; what is wrong goes to ``notes``.
    """
    if len(columns.values) == 0:
        notes.error("the file has no samples", "export it again, or remove it", row=1)
        return ()
    for i, channel in enumerate(case.channels, start=1):
        if columns.present[i]:
            _check_channel(columns.values[:, i], columns.lines, channel, notes)
    if not columns.present[0]:
        return ()
    segments = check_times(columns.values[:, 0], columns.lines, case, notes)
    _check_lengths(segments, columns, case, notes)
    return segments


def _note(
    notes: Notes,
    severity: Severity,
    column: str,
    problem: str,
    remedy: str,
    lines: NDArray[np.int64],
    values: NDArray[np.float64],
) -> None:
    cells = [
        (int(line), f"{value:.12g}")
        for line, value in zip(lines[:ROWS_LISTED], values[:ROWS_LISTED], strict=True)
    ]
    notes.rows(problem, remedy, cells, column=column, severity=severity, total=len(lines))


def _check_channel(
    values: NDArray[np.float64], lines: NDArray[np.int64], channel: Channel, notes: Notes
) -> None:
    outside = (values < channel.min) | (values > channel.max)
    if outside.any():
        _note(
            notes,
            "error",
            channel.name,
            f"the value is outside {channel.min:g} to {channel.max:g} {channel.unit}",
            _range_remedy(values, channel, float(outside.mean())),
            lines[outside],
            values[outside],
        )
    known = values[~np.isnan(values)]
    if len(known) > 1 and known.min() == known.max():
        value = f"{known[0]:.12g}"
        if channel.role == "state":
            notes.error(
                "the state never changes",
                "check the sensor; remove the recording if it was off",
                column=channel.name,
                value=value,
            )
        else:
            notes.warning(
                "the command never changes",
                "nothing, if it was held on purpose",
                column=channel.name,
                value=value,
            )


def _range_remedy(values: NDArray[np.float64], channel: Channel, outside: float) -> str:
    """Say what to do about values outside the limits, which are this share of the column."""
    plain = "mend the value, leave the line out, or widen the channel's min and max"
    unit = channel.unit.casefold()
    # A few values outside are outliers; another unit moves many.
    if outside < _UNIT_SHARE:
        return plain
    if unit.startswith("rad"):
        converted, found, factor = np.deg2rad(values), "degrees", "pi / 180"
    elif unit.startswith(("deg", "°")):
        converted, found, factor = np.rad2deg(values), "radians", "180 / pi"
    else:
        return plain
    known = converted[~np.isnan(converted)]
    if (known >= channel.min).all() and (known <= channel.max).all():
        return f"the column looks like {found}: multiply it by {factor}"
    return plain


def check_times(
    time_s: NDArray[np.float64], lines: NDArray[np.int64], case: Case, notes: Notes
) -> Segments:
    """Check the order and the rate of ``time_s`` (row,), NaN where unknown; return the segments.

    A step longer than the case's ``max_gap_s`` is a gap. Gaps are only looked for where order and
    rate are right: otherwise every step would be one.
    """
    known = np.flatnonzero(~np.isnan(time_s))
    whole: Segments = ((0, len(time_s)),)
    if len(known) < 2:
        return whole
    steps_s = np.diff(time_s[known])
    after = known[1:]
    name = case.source.time_column
    for wrong, problem, remedy in (
        (steps_s == 0, "the time stamp is repeated", "remove one of the two lines"),
        (steps_s < 0, "the time goes back", "sort the lines by time"),
    ):
        if wrong.any():
            at = after[wrong]
            _note(notes, "error", name, problem, remedy, lines[at], time_s[at])
    # A line that could not be read is not a gap: its error is in the notes.
    adjoining = (np.diff(known) == 1) & (steps_s > 0)
    if not adjoining.any() or not _check_rate(steps_s[adjoining], case, notes):
        return whole
    _check_jitter(steps_s, adjoining, lines[after], case, notes)
    gaps = adjoining & (steps_s > case.max_gap_s)
    if not gaps.any():
        return whole
    _note(
        notes,
        "warning",
        name,
        f"a gap: the step is longer than max_gap_s={case.max_gap_s:g}",
        "nothing: no window crosses it",
        lines[after[gaps]],
        steps_s[gaps],
    )
    borders = [0, *after[gaps].tolist(), len(time_s)]
    return tuple(itertools.pairwise(borders))


def _check_rate(steps_s: NDArray[np.float64], case: Case, notes: Notes) -> bool:
    """Return whether positive ``steps_s`` are at the declared rate, up to jitter and gaps."""
    measured_hz = float(1.0 / np.median(steps_s))
    tolerance = _MEDIAN_TOLERANCE
    if abs(measured_hz / case.rate_hz - 1.0) <= tolerance:
        even_s = steps_s[steps_s <= case.max_gap_s]
        samples = np.maximum(np.rint(even_s * case.rate_hz), 1.0).sum()
        measured_hz = float(samples / even_s.sum())
        # Jitter at both ends of a short recording can look like another rate.
        tolerance = RATE_TOLERANCE + 1.0 / samples
    if abs(measured_hz / case.rate_hz - 1.0) <= tolerance:
        return True
    notes.error(
        f"the rate is not rate_hz={case.rate_hz:g}",
        "resample the recording, or change the case's rate_hz (and its steps)",
        column=case.source.time_column,
        value=f"{measured_hz:.4g} Hz",
    )
    return False


def _check_jitter(
    steps_s: NDArray[np.float64],
    adjoining: NDArray[np.bool_],
    lines: NDArray[np.int64],
    case: Case,
    notes: Notes,
) -> None:
    name, period_s = case.source.time_column, 1.0 / case.rate_hz
    # A millionth of a period keeps the rounding of written times out of the comparison.
    slack_s = 1e-6 * period_s
    dense = adjoining & (steps_s < 0.5 * period_s - slack_s)
    if dense.any():
        _note(
            notes,
            "error",
            name,
            "the step is shorter than half a period",
            "remove the sample between the samples, or resample the recording",
            lines[dense],
            steps_s[dense],
        )
    sparse = adjoining & (steps_s > 1.5 * period_s + slack_s) & (steps_s <= case.max_gap_s)
    if sparse.any():
        _note(
            notes,
            "warning",
            name,
            f"a sample is missing, within max_gap_s={case.max_gap_s:g}: windows cross it",
            f"set the case's max_gap_s to {1.5 * period_s:g} to keep windows from crossing it",
            lines[sparse],
            steps_s[sparse],
        )


def _check_lengths(segments: Segments, columns: Columns, case: Case, notes: Notes) -> None:
    needed = case.window.context_steps + case.window.horizon_steps
    short = [(start, stop) for start, stop in segments if stop - start < needed]
    remedy = f"a window takes {needed} samples (context_steps + horizon_steps)"
    if len(short) == len(segments):
        longest = max(stop - start for start, stop in segments)
        problem = "the recording is" if len(segments) == 1 else "every segment is"
        notes.error(
            f"{problem} shorter than one window",
            f"{remedy}; record for longer or shorten the window",
            value=f"{longest} samples",
        )
        return
    notes.rows(
        "the segment after a gap is shorter than context and horizon: nothing is learnt from it",
        remedy,
        [(int(columns.lines[start]), f"{stop - start} samples") for start, stop in short],
        total=len(short),
        severity="warning",
    )
