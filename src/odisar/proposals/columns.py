"""Which columns can be channels, and what their values are like."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.proposals.samples import Sample
from odisar.proposals.times import counts_up

#: Why a column of text is left out.
TEXT = "text: cannot be a channel"

_MISSING_SHARE = 0.05
_CLOCK_NAME = re.compile(r"(^|[_\s./-])(time|timestamp|stamp|epoch|unix|utc|clock)", re.IGNORECASE)
_INDEX_NAME = re.compile(
    r"^(unnamed.*|index|idx|row|no|nr|id|#|n|sample|samples|frame|seq)$", re.IGNORECASE
)

# Numbers that loggers write where they know nothing.
_SENTINELS = (-999.0, -9999.0, -99999.0, 999.0, 9999.0, 99999.0, -99.0, 99.0, -32768.0, 32767.0,
              65535.0, -1e30, 1e30, 999999.0, -999999.0)  # fmt: skip


@dataclass(frozen=True)
class Column:
    """A column of numbers over all samples: ``values`` (row,) without what is missing.

    ``held`` is the share of steps without a change; ``levels`` the number of different values;
    ``rises`` whether it never falls; ``sentinels`` are numbers that stand for nothing.
    """

    name: str
    values: NDArray[np.float64]
    held: float
    levels: int
    rises: bool
    wraps: bool
    missing: float
    sentinels: tuple[float, ...]

    @property
    def low(self) -> float:
        """The least value."""
        return float(self.values.min())

    @property
    def high(self) -> float:
        """The greatest value."""
        return float(self.values.max())


def read_columns(
    samples: Sequence[Sample], candidates: Sequence[str]
) -> tuple[list[Column], dict[str, str]]:
    """Return the columns that can be channels, and of the others why they are left out."""
    left_out: dict[str, str] = {}
    columns: list[Column] = []
    for name in candidates:
        parts = [sample.table[name] for sample in samples]
        reason = _unfit(name, parts)
        if not reason:
            twin = _twin(name, samples, [column.name for column in columns])
            reason = f"the same values as '{twin}'" if twin else ""
        if reason:
            left_out[name] = reason
        else:
            columns.append(_column(name, [part.to_numpy(dtype=float) for part in parts]))
    return columns, left_out


def _unfit(name: str, parts: Sequence["pd.Series[float]"]) -> str:
    """Say why a column can't be a channel; empty if it can."""
    if not all(pd.api.types.is_numeric_dtype(part) for part in parts):
        seen = {str(cell).strip().casefold() for part in parts for cell in part.iloc[:50]}
        is_bool = seen <= {"true", "false", "yes", "no", "on", "off", ""}
        return "true or false in words: write 1 and 0 to use it" if is_bool else TEXT
    values = [np.asarray(part, dtype=np.float64) for part in parts]
    missing = float(np.mean(np.concatenate([np.isnan(part) for part in values])))
    if missing > _MISSING_SHARE:
        return f"{100 * missing:.0f} % of its cells are empty"
    known = [part[~np.isnan(part)] for part in values]
    together = np.concatenate(known)
    if together.min() == together.max():
        return f"it never changes ({together[0]:.6g})"
    return _unfit_counter(name, known)


def _unfit_counter(name: str, known: Sequence[NDArray[np.float64]]) -> str:
    """Say why a column is a number of rows or a clock; empty if it is neither."""
    if all(counts_up(part) for part in known):
        return "it counts the rows"
    if _INDEX_NAME.match(name) and all((np.diff(part) > 0).all() for part in known):
        return "it numbers the rows"
    if _CLOCK_NAME.search(name) and all((np.diff(part) >= 0).all() for part in known):
        return "another clock"
    return ""


def _twin(name: str, samples: Sequence[Sample], others: Sequence[str]) -> str | None:
    """Return an earlier column with the same values."""
    for other in others:
        if all(
            np.array_equal(
                sample.table[name].to_numpy(dtype=float),
                sample.table[other].to_numpy(dtype=float),
                equal_nan=True,
            )
            for sample in samples
        ):
            return other
    return None


def _column(name: str, parts: Sequence[NDArray[np.float64]]) -> Column:
    known = [part[~np.isnan(part)] for part in parts]
    together = np.concatenate(known)
    sentinels = _sentinels(together)
    sound = [part[~np.isin(part, sentinels)] for part in known]
    together_sound = np.concatenate(sound)
    steps = np.concatenate([np.diff(part) for part in sound])
    return Column(
        name,
        together_sound,
        held=float((steps == 0).mean()) if len(steps) else 1.0,
        levels=len(np.unique(together_sound)),
        rises=bool(len(steps)) and bool((steps >= 0).all() or (steps <= 0).all()),
        wraps=_wraps(together_sound, steps),
        missing=1.0 - sum(map(len, known)) / sum(map(len, parts)),
        sentinels=sentinels,
    )


def _sentinels(values: NDArray[np.float64]) -> tuple[float, ...]:
    """Return numbers that stand for "nothing": usual ones, far from all others."""
    found: list[float] = []
    for candidate in _SENTINELS:
        at = values == candidate
        rest = values[~at & ~np.isin(values, found)]
        if at.any() and len(rest) and abs(candidate) > 5 * max(float(np.abs(rest).max()), 1e-9):
            found.append(candidate)
    return tuple(found)


def _wraps(values: NDArray[np.float64], steps: NDArray[np.float64]) -> bool:
    """Return whether values jump by nearly their whole range, as an angle does at its border."""
    span = float(values.max() - values.min())
    if not len(steps) or span < 5:
        return False
    jumps = np.abs(steps) > 0.9 * span
    return bool(jumps.any()) and float(np.abs(steps[~jumps]).max(initial=0.0)) < 0.5 * span


def widened(column: Column, recorded: Sequence[NDArray[np.float64]]) -> Column:
    """Return a column that has also seen the extremes of whole recordings, each (sample,)."""
    if not recorded:
        return column
    extremes = [extreme(values) for values in recorded for extreme in (np.min, np.max)]
    together = np.append(column.values, extremes)
    sentinels = tuple(dict.fromkeys((*column.sentinels, *_sentinels(together))))
    return replace(column, values=together[~np.isin(together, sentinels)], sentinels=sentinels)
