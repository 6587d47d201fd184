"""Find the one format that dates or times of day in text are written in."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.errors import OdisarError
from odisar.proposals.samples import Sample

_YEAR_FIRST = r"(?P<year>\d{4})(?P<ysep>[./-])\d{1,2}(?P=ysep)\d{1,2}"
_YEAR_LAST = (
    r"(?P<first>\d{1,2})(?P<sep>[./-])(?P<second>\d{1,2})(?P=sep)(?P<last>\d{4}|(?<!-)\d\d(?!\d))"
)
_CLOCK = r"(?P<hour>\d{1,2}):\d\d(?P<sec>:\d\d(?:(?P<sign>[.,])\d+)?)?"
_MOMENT = (
    rf"^(?=\d)(?:{_YEAR_FIRST}|{_YEAR_LAST})?(?P<gap>[ T,]+)?(?:{_CLOCK})?"
    r"(?P<half>\s*[AaPp][Mm])?(?P<zone>\s*(?:Z|UTC|[+-]\d\d:?\d\d))?$"
)
_COMPACT = r"^\d{8}T\d{4,6}"
_NAMED = r"(?i)\d.*(jan|feb|mar|apr|may|jun|jul|aug|sep|oct|nov|dec)|(jan|feb|mar|apr|may|jun).*\d"
#: A whole second among fractions of seconds, which %f alone does not read.
WHOLE_SECOND = r"(\d:\d\d:\d\d)(?![\d:.,])"
_ENOUGH = 0.8
_MONTHS = 12


@dataclass(frozen=True)
class DateFormat:
    """How dates are written: one of ``formats``, each as pandas takes it; ``example`` is one.

    There are two formats where nothing tells whether the day or the month stands first.
    """

    formats: tuple[str, ...]
    example: str

    @property
    def is_ambiguous(self) -> bool:
        """Whether the user must say which number is the day."""
        return len(self.formats) > 1

    @property
    def fraction(self) -> str:
        """The sign before fractions of seconds; empty where there are none."""
        at = self.formats[0].find("%f")
        return self.formats[0][at - 1] if at > 0 else ""

    @property
    def is_time_of_day(self) -> bool:
        """Whether there is no date, so that the clock starts anew at midnight."""
        return self.formats[0].startswith(("%H", "%I"))

    def meaning(self, form: str) -> str:
        """Return what the example is in a format, as in "3 April 2024"."""
        moment = pd.to_datetime(self._even(pd.Series([self.example])), format=form).iloc[0]
        return f"{moment.day} {moment:%B %Y}"

    def seconds(self, column: "pd.Series[Any]") -> NDArray[np.float64]:
        """Return (row,) seconds since the first moment, NaN where there is none."""
        try:
            moments = pd.to_datetime(
                self._even(column.astype(str).str.strip()),
                format=self.formats[0],
                errors="coerce",
                utc=True,
            )
        except (ValueError, TypeError, OverflowError):
            return np.full(len(column), np.nan)
        if self.is_time_of_day:
            midnights = (moments.diff() < -pd.Timedelta(hours=12)).cumsum()
            moments = moments + pd.to_timedelta(midnights, unit="D")
        elapsed = moments - moments.min()
        return np.asarray(elapsed.dt.total_seconds(), dtype=np.float64)

    def _even(self, text: "pd.Series[str]") -> "pd.Series[str]":
        sign = self.fraction
        return text.str.replace(WHOLE_SECOND, rf"\1{sign}0", regex=True) if sign else text


def find_dates(name: str, samples: Sequence[Sample]) -> DateFormat | None:
    """Return the format of a column of text over all files; None where it holds no dates.

    Raises
    ------
    OdisarError
        If files write the dates in different ways.
    """
    texts = [sample.table[name].astype(str).str.strip() for sample in samples]
    heads = [text[text != ""].iloc[:20] for text in texts]
    if not all(map(len, heads)):
        return None
    found = _numbers(name, texts) if all(_matches(head, _MOMENT) for head in heads) else None
    if found is None and all(_matches(head, _COMPACT) for head in heads):
        found = DateFormat(("ISO8601",), heads[0].iloc[0])
    if found is None and all(_matches(head, _NAMED) for head in heads):
        found = DateFormat(("mixed",), heads[0].iloc[0])  # a month by its name is no question
    if found is not None and not found.is_ambiguous:
        _check_all(name, samples, found)
    return found


def _matches(head: "pd.Series[str]", pattern: str) -> bool:
    return sum(bool(re.search(pattern, text)) for text in head) >= _ENOUGH * len(head)


def _numbers(name: str, texts: Sequence["pd.Series[str]"]) -> DateFormat | None:
    """Return the format of dates and times in figures."""
    text = pd.concat(texts, ignore_index=True)
    parts = text.str.extract(_MOMENT)
    known = parts[["year", "first", "hour"]].notna().any(axis=1)
    if not known.any():
        return None
    parts, text = parts[known], text[known]
    first = {key: value for key, value in parts.iloc[0].items() if isinstance(value, str)}
    clock = _clock(first, fractions=parts["sign"].dropna())
    if "year" in first:
        sep = first["ysep"]
        is_iso = sep == "-" and "," not in clock and "half" not in first
        return DateFormat(("ISO8601" if is_iso else f"%Y{sep}%m{sep}%d{clock}",), text.iloc[0])
    if "first" not in first:
        return DateFormat((clock,), text.iloc[0])
    sep, year = first["sep"], "%Y" if len(first["last"]) > 2 else "%y"
    orders = _orders(name, parts, text)
    formats = tuple(f"{a}{sep}{b}{sep}{year}{clock}" for a, b in orders)
    return DateFormat(formats, _telling(parts, text))


def _clock(first: dict[Any, str], fractions: "pd.Series[str]") -> str:
    """Return the format of what follows a date."""
    text = first.get("gap", "")
    if "hour" in first:
        text += ("%I" if "half" in first else "%H") + ":%M" + (":%S" if "sec" in first else "")
        text += f"{fractions.iloc[0]}%f" if len(fractions) else ""
    if "half" in first:
        text += " " * first["half"].count(" ") + "%p"
    zone = first.get("zone", "")
    return text + (zone if "UTC" in zone else " " * zone.count(" ") + "%z" if zone else "")


def _orders(name: str, parts: pd.DataFrame, text: "pd.Series[str]") -> tuple[tuple[str, str], ...]:
    """Return whether the day or the month stands first; both where nothing tells."""
    day_first, month_first = ("%d", "%m"), ("%m", "%d")
    days, months = (parts[key].astype(float) > _MONTHS for key in ("first", "second"))
    if days.any() and months.any():
        raise OdisarError(
            f"column '{name}' holds dates in two ways, {text[days].iloc[0]!r} with the day first "
            f"and {text[months].iloc[0]!r} with the month first: write all of them one way"
        )
    if months.any():
        return (month_first,)
    if days.any() or parts["sep"].dropna().eq(".").all():
        return (day_first,)
    return (day_first, month_first)


def _telling(parts: pd.DataFrame, text: "pd.Series[str]") -> str:
    """Return a date whose day and month differ, where there is one."""
    differ = parts["first"].astype(float) != parts["second"].astype(float)
    return str((text[differ] if differ.any() else text).iloc[0])


def _check_all(name: str, samples: Sequence[Sample], found: DateFormat) -> None:
    for sample in samples:
        column = sample.table[name].astype(str).str.strip()
        unread = column[np.isnan(found.seconds(column)) & (column != "").to_numpy()]
        if len(unread) > (1 - _ENOUGH) * len(column):
            raise OdisarError(
                f"{sample.path.name}: column '{name}' holds {unread.iloc[0]!r}, other files dates "
                f"as {found.example!r}: write all of them one way"
            )
