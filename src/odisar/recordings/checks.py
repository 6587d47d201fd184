"""Checks of one file's numbers: its time stamps, its ranges, and whether anything moves at all."""

import itertools

import numpy as np
from numpy.typing import NDArray

from odisar.config.cases import Case, Channel
from odisar.recordings.heading_checks import check_heading
from odisar.recordings.quality import Notes
from odisar.recordings.resampling import held_samples, rounding_periods
from odisar.recordings.table import Advice, Table, note_rows

#: A measured rate this far from the declared one is another rate, not a drifting clock.
RATE_TOLERANCE = 0.01

# Beyond this the median step is not one period: counting samples by rounding would hide it.
_MEDIAN_TOLERANCE = 0.25

_UNIT_SHARE = 0.05

_PARTS_OF_A_SECOND = {"milliseconds": 10**3, "microseconds": 10**6, "nanoseconds": 10**9}

Segments = tuple[tuple[int, int], ...]


def check_table(table: Table, case: Case, notes: Notes) -> Segments:
    """Check a table whose first column is time and whose others are the case's channels.

    Returns the half-open ranges of its rows between gaps; what is wrong goes to ``notes``.
    """
    if len(table.values) == 0:
        row = table.advice.header_row
        notes.error("the file has no samples", "export it again, or remove it", row=row)
        return ()
    for i, channel in enumerate(case.channels, start=1):
        if table.present[i]:
            _check_channel(table, i, channel, notes)
    check_heading(table, case, notes)
    if not table.present[0]:
        return ()
    segments = check_times(table, case, notes)
    _check_lengths(segments, table, case, notes)
    return segments


def _check_channel(table: Table, column: int, channel: Channel, notes: Notes) -> None:
    values, lines = table.values[:, column], table.lines
    outside = (values < channel.min) | (values > channel.max)
    if outside.any():
        note_rows(
            notes,
            "error",
            channel.name,
            f"the value is outside {channel.min:g} to {channel.max:g} {channel.unit}",
            _range_remedy(values, channel, float(outside.mean()), table.advice),
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


def _range_remedy(
    values: NDArray[np.float64], channel: Channel, outside: float, advice: Advice
) -> str:
    """Say what to do about values outside the limits, which are this share of the column."""
    plain = f"{advice.outside}, or widen the channel's min and max"
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


def check_times(table: Table, case: Case, notes: Notes) -> Segments:
    """Check the order and the rate of a table's times, NaN where unknown; return the segments.

    A step longer than the case's ``max_gap_s`` is a gap. Gaps are only looked for where order and
    rate are right: otherwise every step would be one.
    """
    time_s, lines = table.values[:, 0], table.lines
    known = np.flatnonzero(~np.isnan(time_s))
    whole: Segments = ((0, len(time_s)),)
    if len(known) < 2:
        return whole
    steps_s = np.diff(time_s[known])
    after = known[1:]
    name = case.source.time_column
    for wrong, problem, remedy in (
        (steps_s == 0, "the time stamp is repeated", table.advice.repeated),
        (steps_s < 0, "the time goes back", table.advice.backward),
    ):
        if wrong.any():
            at = after[wrong]
            note_rows(notes, "error", name, problem, remedy, lines[at], time_s[at])
    # A line that could not be read is not a gap: its error is in the notes.
    adjoining = (np.diff(known) == 1) & (steps_s > 0)
    if not adjoining.any() or not _check_pace(time_s[known], adjoining, lines[after], case, notes):
        return whole
    gaps = adjoining & (steps_s > case.max_gap_s)
    if not gaps.any():
        return whole
    note_rows(
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


def _check_pace(
    time_s: NDArray[np.float64],
    adjoining: NDArray[np.bool_],
    lines: NDArray[np.int64],
    case: Case,
    notes: Notes,
) -> bool:
    """Return whether the samples come as the case says, or faster where they are resampled."""
    steps_s = np.diff(time_s)
    held = case.source.resample != "none"
    check = _check_not_slower if held else _check_rate
    if not check(steps_s[adjoining], case, notes):
        return False
    # The rounding of written times is kept out of the comparison.
    slack_s = rounding_periods(time_s, case.rate_hz) / case.rate_hz
    if not held:
        _check_dense(steps_s, adjoining, lines, slack_s, case, notes)
    _check_sparse(steps_s, adjoining, lines, slack_s, case, notes)
    return True


def _check_not_slower(steps_s: NDArray[np.float64], case: Case, notes: Notes) -> bool:
    measured_hz = float(1.0 / np.median(steps_s))
    if measured_hz >= case.rate_hz * (1.0 - RATE_TOLERANCE):
        return True
    notes.error(
        f"the recording is slower than rate_hz={case.rate_hz:g}",
        _other_unit(measured_hz, case)
        or "lower the case's rate_hz (and its steps): resampling would invent samples",
        column=case.source.time_column,
        value=f"{measured_hz:.4g} Hz",
    )
    return False


def _other_unit(measured_hz: float, case: Case) -> str:
    """Say what to do about times that are no seconds, empty where they seem to be."""
    for unit, parts in _PARTS_OF_A_SECOND.items():
        if abs(measured_hz * parts / case.rate_hz - 1.0) <= _MEDIAN_TOLERANCE:
            return f"the times look like {unit}: divide them by {parts:,}, time is in seconds"
    return ""


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
    faster = measured_hz > case.rate_hz
    resample = "set source.resample to hold or thin" if faster else "resample the recording"
    notes.error(
        f"the rate is not rate_hz={case.rate_hz:g}",
        _other_unit(measured_hz, case)
        or f"{resample}, or change the case's rate_hz (and its steps)",
        column=case.source.time_column,
        value=f"{measured_hz:.4g} Hz",
    )
    return False


def _check_dense(
    steps_s: NDArray[np.float64],
    adjoining: NDArray[np.bool_],
    lines: NDArray[np.int64],
    slack_s: float,
    case: Case,
    notes: Notes,
) -> None:
    dense = adjoining & (steps_s < 0.5 / case.rate_hz - slack_s)
    if dense.any():
        note_rows(
            notes,
            "error",
            case.source.time_column,
            "the step is shorter than half a period",
            "remove the sample between the samples, or resample the recording",
            lines[dense],
            steps_s[dense],
        )


def _check_sparse(
    steps_s: NDArray[np.float64],
    adjoining: NDArray[np.bool_],
    lines: NDArray[np.int64],
    slack_s: float,
    case: Case,
    notes: Notes,
) -> None:
    longest_s = 1.5 / case.rate_hz
    sparse = adjoining & (steps_s > longest_s + slack_s) & (steps_s <= case.max_gap_s)
    if sparse.any():
        crossed = "windows cross it"
        if case.source.resample == "hold":
            crossed = f"the last sample is held over up to {steps_s[sparse].max():.6g} s"
        note_rows(
            notes,
            "warning",
            case.source.time_column,
            f"a sample is missing, within max_gap_s={case.max_gap_s:g}: {crossed}",
            f"set the case's max_gap_s to {longest_s:g} to keep windows from crossing it",
            lines[sparse],
            steps_s[sparse],
        )


def _check_lengths(segments: Segments, table: Table, case: Case, notes: Notes) -> None:
    needed = case.window.context_steps + case.window.horizon_steps
    lengths = [_length(table.values[start:stop, 0], case) for start, stop in segments]
    remedy = f"a window takes {needed} samples (context_steps + horizon_steps)"
    if max(lengths) < needed:
        problem = "the recording is" if len(segments) == 1 else "every segment is"
        notes.error(
            f"{problem} shorter than one window",
            f"{remedy}; record for longer or shorten the window",
            value=f"{max(lengths)} samples",
        )
        return
    short = [
        (int(table.lines[start]), f"{length} samples")
        for (start, _), length in zip(segments, lengths, strict=True)
        if length < needed
    ]
    notes.rows(
        "the segment after a gap is shorter than context and horizon: nothing is learnt from it",
        remedy,
        short,
        total=len(short),
        severity="warning",
    )


def _length(time_s: NDArray[np.float64], case: Case) -> int:
    """Return the number of samples of a segment, after resampling where it is resampled."""
    if case.source.resample == "none" or not (np.diff(time_s) > 0).all():
        return len(time_s)
    held = held_samples(time_s, case.rate_hz)
    return len(held) if case.source.resample == "hold" else len(np.unique(held))
