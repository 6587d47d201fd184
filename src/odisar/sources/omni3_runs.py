"""One published run of the three-wheel robot: read, checked, and brought to the case's rate.

A run's CSV has no header: time [s], x [m], y [m] and heading [rad] of the tracked pose, then the
ticks of wheels 1 to 3 since the sample before. Its session's metadata CSV has a row for each entry;
read are ``ngear`` (gear ratio), ``encRes`` (ticks a motor turn), ``Li`` (wheel to centre [m]) and
``Di`` (diameters of wheels 1 to 3 [m]).
"""

import csv
import re
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from odisar.config.sources import Omni3Config
from odisar.errors import OdisarError
from odisar.recordings.resampling import hold_on_grid

FloatArray = NDArray[np.float64]

_COLUMNS = ("time", "x", "y", "heading", "ticks 1", "ticks 2", "ticks 3")
_METADATA = {"ngear": 1, "encRes": 1, "Li": 1, "Di": 3}
_ROBOT_TYPE = "omni3"
_NAME = re.compile(
    r"(?P<maneuver>[a-z]+)/(?P<session>\d+)/(?P=session)_run-(?P<number>\d+)\.csv", re.ASCII
)
_STAMP_DECIMALS = 6
_TIME_TOLERANCE_S = 1.0e-3


@dataclass(frozen=True, order=True)
class Run:
    """Which run it is; ``path`` and ``metadata`` are relative to the folder of published files."""

    maneuver: str
    session: str
    number: str

    @property
    def name(self) -> str:
        """Name of its recording."""
        return f"{self.maneuver}-{self.session}-run-{self.number}"

    @property
    def path(self) -> str:
        """Path of the run's file."""
        return f"{self.maneuver}/{self.session}/{self.session}_run-{self.number}.csv"

    @property
    def metadata(self) -> str:
        """Path of the session's metadata."""
        return f"{self.maneuver}/{self.session}/{self.session}_metadata.csv"


@dataclass(frozen=True)
class Robot:
    """What turns ticks into speeds: metres a tick of each wheel (3,), and wheel to centre [m]."""

    m_per_tick: FloatArray
    radius_m: float


def list_runs(paths: Iterable[str]) -> list[Run]:
    """Return the runs among the published paths, by manoeuvre, session and number."""
    found = (_NAME.fullmatch(path) for path in paths)
    return sorted(Run(m["maneuver"], m["session"], m["number"]) for m in found if m)


def read_robot(path: Path) -> Robot:
    """Return the robot that a session's metadata describe.

    Raises
    ------
    OdisarError
        The file cannot be read, is of another type of robot, or an entry is missing or is not a
        number above zero.
    """
    rows = {row[0]: (line, row[1:]) for line, row in enumerate(_rows(path), start=1) if row}
    line, cells = rows.get("type", (1, []))
    if cells[:1] != [_ROBOT_TYPE]:
        raise OdisarError(
            f"{path}: row {line}, column 2: the type is {cells[0] if cells else 'missing'!r}, "
            f"expected {_ROBOT_TYPE!r}; give the file as published"
        )
    entries: dict[str, list[float]] = {}
    for name, count in _METADATA.items():
        if name not in rows:
            raise OdisarError(f"{path}: no row {name!r}; give the file as published")
        line, cells = rows[name]
        if len(cells) < count:
            raise OdisarError(
                f"{path}: row {line}, column {len(cells) + 2}: {name} needs {count} value(s); give "
                "the file as published"
            )
        entries[name] = [
            _number(path, line, column, name, cell)
            for column, cell in enumerate(cells[:count], start=2)
        ]
        if min(entries[name]) <= 0:
            raise OdisarError(
                f"{path}: row {line}: {name} is {min(entries[name]):g}, expected more than 0; give "
                "the file as published"
            )
    ticks_per_turn = entries["ngear"][0] * entries["encRes"][0]
    return Robot(np.pi * np.array(entries["Di"]) / ticks_per_turn, entries["Li"][0])


def read_run(path: Path, config: Omni3Config) -> FloatArray:
    """Return (sample, 7) the columns of a run's file; stamps are rounded to a microsecond.

    Raises
    ------
    OdisarError
        The file cannot be read or has no samples, a row has other columns, a value is not a
        number, or time goes back or isn't at ``raw_rate_hz``.
    """
    values = [
        [_number(path, line, i + 1, _COLUMNS[i], cell) for i, cell in enumerate(row)]
        for line, row in enumerate(_rows(path), start=1)
        if _has_columns(path, line, row)
    ]
    if not values:
        raise OdisarError(f"{path}: row 1: there are no samples; give the file as published")
    run = np.array(values)
    run[:, 0] = np.round(run[:, 0], _STAMP_DECIMALS)
    _check_times(path, run[:, 0], config.raw_rate_hz)
    return run


def convert_run(
    run: FloatArray, robot: Robot, config: Omni3Config
) -> tuple[FloatArray, FloatArray]:
    """Return times (step,) [s] and values (step, 6) at ``rate_hz``, in the order of the case.

    Each step of the grid takes the last sample at or before it, under that sample's own stamp: at
    25 Hz the samples taken are 80 and 120 ms apart by turns, and a pose's increment divided by
    the period instead would be wrong by a fifth. Velocities are the ticks since the sample taken
    before, over the stamps' difference: no tick is lost and none comes from later. The first
    sample has none and is left out, as are those at the end that don't fill a whole pattern of
    steps: without them the mean step is the period.

    Parameters
    ----------
    run
        (sample, 7) as from ``read_run``.
    """
    travelled_m = np.cumsum(run[:, 4:], axis=0) * robot.m_per_tick
    # A step shows the stamp of the sample it holds: carried along as a column.
    _, held = hold_on_grid(run[:, 0], np.column_stack([run[:, :4], travelled_m]), config.rate_hz)
    stamps_s = held[:, 0]
    wheels_m_s = np.diff(held[:, 4:], axis=0) / np.diff(stamps_s)[:, None]
    values = np.column_stack(
        [
            held[1:, 1:3],
            wrap_heading(held[1:, 3]),
            body_velocities(wheels_m_s, robot.radius_m),
        ]
    )
    pattern = Fraction(config.raw_rate_hz / config.rate_hz).limit_denominator(100).denominator
    steps = max(0, len(values) - 1) // pattern * pattern
    return stamps_s[1 : steps + 2], values[: steps + 1]


def body_velocities(wheels_m_s: FloatArray, radius_m: float) -> FloatArray:
    """Return (..., 3) velocity ahead and to the left [m/s] and yaw rate [rad/s], left positive.

    ``wheels_m_s`` (..., 3) are the rims' speeds of wheels at -60, 60 and 180 degrees from ahead.
    """
    first, second, third = np.moveaxis(wheels_m_s, -1, 0)
    return np.stack(
        [
            (second - first) / np.sqrt(3.0),
            (2.0 * third - first - second) / 3.0,
            -(first + second + third) / (3.0 * radius_m),
        ],
        axis=-1,
    )


def wrap_heading(heading: FloatArray) -> FloatArray:
    """Return the angle [rad] in (-pi, pi]."""
    return np.pi - (np.pi - heading) % (2.0 * np.pi)


def _rows(path: Path) -> list[list[str]]:
    try:
        with path.open(encoding="utf-8", newline="") as handle:
            return list(csv.reader(handle))
    except (OSError, ValueError, csv.Error) as error:
        raise OdisarError(f"{path}: cannot be read as CSV ({error}); fetch it again") from error


def _has_columns(path: Path, line: int, row: list[str]) -> bool:
    if len(row) == len(_COLUMNS):
        return True
    raise OdisarError(
        f"{path}: row {line}: found {len(row)} columns, expected {len(_COLUMNS)} "
        f"({', '.join(_COLUMNS)}); give the file as published"
    )


def _number(path: Path, line: int, column: int, name: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise OdisarError(
            f"{path}: row {line}, column {column} ({name}): {cell!r} is not a number; give the "
            "file as published"
        )
    return value


def _check_times(path: Path, time_s: FloatArray, raw_rate_hz: float) -> None:
    steps_s = np.diff(time_s)
    wrong = np.flatnonzero(np.abs(steps_s - 1.0 / raw_rate_hz) > _TIME_TOLERANCE_S)
    if not len(wrong):
        return
    step_s = steps_s[wrong[0]]
    problem = (
        f"the time goes back or stands still (a step of {step_s:g} s)"
        if step_s <= 0
        else f"a step of {step_s:g} s where sources.omni3.raw_rate_hz={raw_rate_hz:g} says "
        f"{1.0 / raw_rate_hz:g} s"
    )
    raise OdisarError(
        f"{path}: row {wrong[0] + 2}, column 1 (time): {problem}; give the file as published"
    )
