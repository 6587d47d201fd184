"""Find the column that is time, its unit, and how evenly the samples come."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.errors import OdisarError
from odisar.proposals.dates import DateFormat, find_dates
from odisar.proposals.samples import Sample, names
from odisar.proposals.units import words

_TIME_WORDS = frozenset({
    "time", "times", "timestamp", "timestamps", "t", "stamp", "sec", "secs", "seconds", "elapsed",
    "epoch", "clock", "utc", "datetime", "date", "zeit", "zeitstempel", "tid", "temps", "tiempo",
    "tijd", "uhrzeit", "ms", "ns", "us",
})  # fmt: skip

#: Seconds of a unit that a name tells, at its end or in brackets.
_UNITS = {
    "s": 1.0, "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3,
    "millis": 1e-3, "milliseconds": 1e-3, "us": 1e-6, "µs": 1e-6, "usec": 1e-6, "micros": 1e-6,
    "microseconds": 1e-6, "ns": 1e-9, "nsec": 1e-9, "nanos": 1e-9, "nanoseconds": 1e-9,
    "min": 60.0, "minutes": 60.0, "h": 3600.0, "hours": 3600.0,
}  # fmt: skip
_UNIT_NAMES = {1e-3: "milliseconds", 1e-6: "microseconds", 1e-9: "nanoseconds", 60.0: "minutes"}

# Clocks that count from 1970 to now, by the size of their numbers.
_EPOCHS = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3), (8e8, 1.0))

_NICE_HZ = (
    0.1, 0.2, 0.5, 1, 2, 3, 4, 5, 8, 10, 12.5, 15, 16, 20, 25, 30, 32, 40, 48, 50, 60, 64, 75, 80,
    90, 100, 120, 125, 128, 150, 200, 240, 250, 256, 300, 400, 500, 512, 1000, 1024, 2000,
)  # fmt: skip
_NICE_S = (15, 20, 30, 60, 120, 300, 600, 900, 1800, 3600)


SECONDS_DOUBT = "taken for seconds"


@dataclass(frozen=True)
class TimeColumn:
    """The time column: ``scale_s`` seconds a unit; ``is_text`` where it holds dates as text.

    ``dates`` says how these are written.
    """

    name: str
    scale_s: float
    is_text: bool
    is_epoch: bool
    doubt: str
    dates: DateFormat | None = None

    @property
    def unit_name(self) -> str:
        """What the numbers of the column are."""
        return "text" if self.is_text else _UNIT_NAMES.get(self.scale_s, "seconds")

    @property
    def is_readable(self) -> bool:
        """Whether the pipeline's readers take the column as it is."""
        return not self.is_text and self.scale_s == 1.0

    def seconds(self, sample: Sample) -> NDArray[np.float64]:
        """Return (row,) the times of a sample in seconds, NaN where there is none."""
        return _seconds(sample, self.name, self.dates) * self.scale_s


@dataclass(frozen=True)
class Pace:
    """How often samples come, [Hz], in the middle of all files; and how evenly."""

    rate_hz: float
    slowest_hz: float
    is_even: bool
    doubt: str


def find_time(samples: Sequence[Sample], columns: Sequence[str]) -> TimeColumn:
    """Return the time column among ``columns``, which all samples have.

    Raises
    ------
    OdisarError
        If no column rises from row to row, with the way out.
    """
    dates = {
        name: find_dates(name, samples)
        for name in columns
        if not any(_is_numeric(sample, name) for sample in samples)
    }
    ranked = sorted(
        (
            (_score(name, samples, dates.get(name)), -place, name)
            for place, name in enumerate(columns)
        ),
        reverse=True,
    )
    best = ranked[0] if ranked else (0.0, 0, "")
    score, _, name = best
    if score <= 0:
        raise OdisarError(
            f"{samples[0].path.name}: no column looks like time (rises from row to row): "
            f"{names(list(columns), 12)}. Add a column of seconds, such as time_s; where samples "
            "come evenly it is the number of the row divided by the rate"
        )
    is_text = not _is_numeric(samples[0], name)
    first = _first_number(samples[0], name)
    below = samples[0].units.get(name, "")
    told = f"{name} [{below}]" if below else name
    scale_s, is_epoch, doubt = (1.0, False, "") if is_text else _scale(told, first)
    others = [other for points, _, other in ranked[1:] if points >= score - 0.5 and points > 1]
    if others:
        doubt = f"or is it {names(others, 3)}?"
    elif score < 2:
        doubt = "the only column that rises from row to row"
    return TimeColumn(name, scale_s, is_text, is_epoch, doubt, dates.get(name))


def _is_numeric(sample: Sample, name: str) -> bool:
    return pd.api.types.is_numeric_dtype(sample.table[name])


def _first_number(sample: Sample, name: str) -> float:
    column = sample.table[name]
    known = column.dropna() if _is_numeric(sample, name) else pd.Series(dtype=float)
    return float(known.iloc[0]) if len(known) else 0.0


def _score(name: str, samples: Sequence[Sample], dates: DateFormat | None) -> float:
    """Return how much a column looks like time: above 0 if it rises, above 2 if called so."""
    parts = words(name)
    called = any(part in _TIME_WORDS for part in parts) or _unit_word(name) == "s" == name
    if not all(_rises(_seconds(sample, name, dates), lenient=called) for sample in samples):
        return 0.0
    exact = bool(parts) and parts[0] in _TIME_WORDS
    if not called:
        return 0.0 if any(_counts_rows(sample, name) for sample in samples) else 1.0
    numeric = all(_is_numeric(sample, name) for sample in samples)
    return 2.0 + exact + (1.0 if numeric else 0.0) + 0.5 * (_unit_word(name) in _UNITS)


def _seconds(sample: Sample, name: str, dates: DateFormat | None) -> NDArray[np.float64]:
    """Return (row,) values of a column as numbers, NaN where there is none."""
    column = sample.table[name]
    if _is_numeric(sample, name):
        return column.to_numpy(dtype=np.float64)
    return dates.seconds(column) if dates else np.full(len(column), np.nan)


def _rises(values: NDArray[np.float64], *, lenient: bool) -> bool:
    """Return whether a column rises from row to row; one called time may do so less well."""
    known = values[~np.isnan(values)]
    if len(known) < 2 or len(known) < 0.8 * len(values):
        return False
    steps = np.diff(known)
    return float((steps > 0).mean()) >= (0.6 if lenient else 0.999)


def _counts_rows(sample: Sample, name: str) -> bool:
    return _is_numeric(sample, name) and counts_up(
        sample.table[name].to_numpy(dtype=np.float64, na_value=np.nan)
    )


def counts_up(values: NDArray[np.floating[Any]]) -> bool:
    """Return whether (row,) values are whole numbers that count up by one."""
    return len(values) > 1 and bool((np.diff(values) == 1).all() and float(values[0]).is_integer())


def _unit_word(name: str) -> str:
    match = re.search(r"[\[(]\s*([a-zµ]+)\s*[\])]\s*$", name.casefold())
    if match:
        return match[1]
    return re.split(r"[_\s./-]", name.strip().casefold())[-1]


def _scale(name: str, first: float) -> tuple[float, bool, str]:
    """Return seconds a unit, whether it counts from 1970, and what is doubtful about it."""
    told = _UNITS.get(_unit_word(name)) if _unit_word(name) != name.casefold() else None
    told = told if told is not None else _UNITS.get(name.strip().casefold())
    for above, scale_s in _EPOCHS:
        if first > above and (told in (None, scale_s)):
            return scale_s, True, "" if told else "its numbers look like a clock since 1970"
    return (1.0, False, SECONDS_DOUBT) if told is None else (told, False, "")


def measure_pace(times: Sequence[NDArray[np.float64]]) -> Pace:
    """Return the pace of recordings with these times, each (row,) in seconds.

    Even is what the quality check takes without resampling: no step below half a period, and the
    counted rate within half a percent of the nice one.
    """
    steps = [np.diff(time_s[~np.isnan(time_s)]) for time_s in times]
    steps = [step[step > 0] for step in steps if (step > 0).any()]
    if not steps:
        raise OdisarError("no recording has two samples one after the other: nothing to propose")
    rates = [1.0 / float(np.median(step)) for step in steps]
    counted = [_counted_hz(step, rate_hz) for step, rate_hz in zip(steps, rates, strict=True)]
    rate_hz, off = nice_rate(float(np.median(counted)))
    slowest, fastest = min(counted), max(counted)
    dense = any((step < 0.5 / rate_hz * (1 - 1e-6)).any() for step in steps)
    is_even = not dense and max(abs(slowest / rate_hz - 1), abs(fastest / rate_hz - 1)) < 0.008
    doubt = f"measured {float(np.median(counted)):.5g} Hz" if off else ""
    if fastest > slowest * 1.01:
        doubt = f"files differ: {slowest:.4g} to {fastest:.4g} Hz"
    return Pace(rate_hz, min(rates), is_even, doubt)


def _counted_hz(steps_s: NDArray[np.float64], rate_hz: float) -> float:
    """Return samples over time at about ``rate_hz``, without gaps.

    Where stamps are even a longer step is that of a missing sample, else it is one of many kinds.
    """
    even = not (steps_s < 0.5 / rate_hz).any()
    near = steps_s[steps_s <= (1.5 if even else 3.0) / rate_hz]
    return len(near) / float(near.sum()) if len(near) else rate_hz


def nice_rate(rate_hz: float) -> tuple[float, bool]:
    """Return a usual rate within half a percent, or four digits; and whether it is neither."""
    usual = [*map(float, _NICE_HZ), *(1.0 / period_s for period_s in _NICE_S)]
    nearest = min(usual, key=lambda candidate: abs(rate_hz / candidate - 1))
    if abs(rate_hz / nearest - 1) <= 0.005:
        return float(f"{nearest:.6g}"), abs(rate_hz / nearest - 1) > 1e-4
    return float(f"{rate_hz:.4g}"), True
