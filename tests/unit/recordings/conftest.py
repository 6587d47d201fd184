"""A small case (two states, one command, 1 Hz) and a folder of good recordings to spoil.

A recording can be written in each format; a bag has the boat's speed in /odom (a header), its
heading in /joint_states (a header) and its rudder in /rudder (no header).
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from odisar.config.cases import Case
from odisar.recordings.quality import Finding
from odisar.recordings.reader import ReadResult, read_case
from odisar.recordings.schema import Recording, RecordingInfo
from small_system import SCORE

from .ros_bags import STORAGES, Message, Ros

BAG_LAYOUT: dict[str, Any] = {
    "stamp_topic": "/odom",
    "stamp": "header",
    "max_age_s": 1.5,
    "fields": {
        "Rudder": "/rudder:data",
        "Speed": "/odom:twist.twist.linear.x",
        "Heading": "/joint_states:position[1]",
    },
}
HEADER = "time_s,Rudder,Speed,Heading\n"


def case_values() -> dict[str, Any]:
    def channel(name: str, unit: str, role: str, limit: float) -> dict[str, Any]:
        return {
            "name": name,
            "unit": unit,
            "role": role,
            "output": role == "state",
            "known_ahead": False,
            "min": -limit,
            "max": limit,
        }

    return {
        "title": "a small boat",
        "source": {
            "folder": "boat",
            "maker": "none",
            "time_column": "time_s",
            "max_recordings": 20,
            "csv": {"separator": "comma", "decimal": "point"},
            "bag": None,
            "resample": "none",
        },
        "rate_hz": 1.0,
        "max_gap_s": 1.5,
        "channels": [
            channel("Rudder", "deg", "command", 60.0),
            channel("Speed", "m/s", "state", 15.0),
            channel("Heading", "rad", "state", 3.2),
        ],
        "pose": None,
        "window": {"context_steps": 6, "horizon_steps": 4},
        "splits": {
            "kind": "fractions",
            "fractions": {"train": 0.4, "validation": 0.2, "calibration": 0.2, "test": 0.2},
            "folds": None,
            "block_s": None,
            "block_gap_s": None,
        },
        "score": SCORE,
        "persistence_s": 2.0,
        "short_lead_s": 1.0,
        "guard_start_s": 10.0,
        "guard_end_s": 10.0,
        "groups": {"overall": {}, "group_by": [], "apart": [], "with_clean": []},
        "faults": None,
        "range_rules": [],
    }


@pytest.fixture
def make_case() -> Callable[..., Case]:
    """Build the small case; sections given are merged into it."""

    def make(**sections: Any) -> Case:
        values = case_values()
        for name, section in sections.items():
            old = values[name]
            merged = isinstance(section, dict) and isinstance(old, dict)
            values[name] = old | section if merged else section
        return Case(**values)

    return make


def good_lines(samples: int = 30) -> list[str]:
    return [
        f"{i},{10 * np.sin(i):.4f},{5 + np.cos(i):.4f},{0.1 * np.sin(i / 3):.4f}\n"
        for i in range(samples)
    ]


class Boat:
    """The folder of the small case; files are written as text or bytes."""

    def __init__(self, root: Path, case: Case) -> None:
        self.root, self.case = root, case
        self.folder = root / case.source.folder
        self.folder.mkdir()

    def write(self, name: str, content: str | bytes) -> Path:
        path = self.folder / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    def good(self, name: str, samples: int = 30) -> Path:
        return self.write(name, HEADER + "".join(good_lines(samples)))

    def spoiled(self, changes: dict[int, str], name: str = "a.csv", samples: int = 30) -> Path:
        """Write a good file with the lines of these numbers (the header is 1) replaced."""
        lines = [HEADER, *good_lines(samples)]
        for number, line in changes.items():
            lines[number - 1] = line
        return self.write(name, "".join(lines))

    def read(self) -> ReadResult:
        return read_case("boat", self.case, self.root)

    def found(self, problem: str) -> list[Finding]:
        return [finding for finding in self.read().findings if problem in finding.problem]

    def one(self, problem: str) -> Finding:
        found = self.found(problem)
        assert len(found) == 1, self.read().findings
        return found[0]


@pytest.fixture
def make_boat(tmp_path: Path, make_case: Callable[..., Case]) -> Callable[..., Boat]:
    return lambda **sections: Boat(tmp_path, make_case(**sections))


@pytest.fixture
def boat(make_boat: Callable[..., Boat]) -> Boat:
    return make_boat()


@pytest.fixture
def bag_boat(make_boat: Callable[..., Boat]) -> Boat:
    return make_boat(source={"bag": BAG_LAYOUT})


@pytest.fixture
def boat_with(make_boat: Callable[..., Boat]) -> Callable[..., Boat]:
    """Build the boat with another layout of bags; fields given replace those of the channel."""

    def make(fields: dict[str, str] | None = None, **layout: Any) -> Boat:
        taken = BAG_LAYOUT["fields"] | (fields or {})
        return make_boat(source={"bag": BAG_LAYOUT | layout | {"fields": taken}})

    return make


@pytest.fixture
def ros() -> type[Ros]:
    return Ros


@pytest.fixture(params=sorted(STORAGES))
def storage(request: pytest.FixtureRequest) -> str:
    return request.param


def good_columns(samples: int = 30) -> dict[str, Any]:
    """Return the columns of a good recording, with all digits of a 64-bit float."""
    i = np.arange(samples)
    return {
        "Rudder": 10 * np.sin(i),
        "Speed": 5 + np.cos(i),
        "Heading": 0.1 * np.sin(i / 3),
    }


@pytest.fixture
def columns() -> dict[str, Any]:
    return good_columns()


@pytest.fixture
def messages(columns: dict[str, Any]) -> list[Message]:
    return Ros.boat(np.arange(30.0), columns)


FORMATS = ("csv", "parquet", "mcap", "sqlite")


@pytest.fixture(params=FORMATS)
def write_format(request: pytest.FixtureRequest, bag_boat: Boat) -> Callable[..., Path]:
    """Write a recording called ``a`` of times and columns, in each of the formats."""

    def write(time_s: Any, columns: dict[str, Any], name: str = "a") -> Path:
        path = bag_boat.folder / name
        table = {"time_s": np.asarray(time_s, dtype=float), **columns}
        if request.param == "csv":
            rows = zip(*table.values(), strict=True)
            lines = [",".join(map(repr, map(float, row))) for row in rows]
            return bag_boat.write(f"{name}.csv", "\n".join([",".join(table), *lines, ""]))
        if request.param == "parquet":
            parquet.write_table(pa.table(table), path.with_suffix(".parquet"))
            return path.with_suffix(".parquet")
        return Ros.write(path, Ros.boat(time_s, columns), request.param)

    return write


@pytest.fixture
def make_recording() -> Callable[..., Recording]:
    def make(
        name: str, samples: int = 100, segments: tuple[tuple[int, int], ...] = (), **info: Any
    ) -> Recording:
        time_s = np.arange(samples, dtype=float)
        for number, (start, _) in enumerate(segments):
            time_s[start:] += 10.0 if number else 0.0
        values = np.column_stack([np.sin(time_s), np.cos(time_s), time_s])
        return Recording(
            name, RecordingInfo(case="boat", **info), time_s, values, segments=segments
        )

    return make
