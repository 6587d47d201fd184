"""A small case (two states, one command, 1 Hz) and a folder of good recordings to spoil."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from odisar.config.cases import Case
from odisar.recordings.quality import Finding
from odisar.recordings.reader import ReadResult, read_case
from odisar.recordings.schema import Recording, RecordingInfo

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
        },
        "rate_hz": 1.0,
        "max_gap_s": 1.5,
        "channels": [
            channel("Rudder", "deg", "command", 60.0),
            channel("Speed", "m/s", "state", 15.0),
            channel("Heading", "rad", "state", 3.2),
        ],
        "window": {"context_steps": 6, "horizon_steps": 4},
        "splits": {
            "kind": "fractions",
            "fractions": {"train": 0.4, "validation": 0.2, "calibration": 0.2, "test": 0.2},
            "folds": None,
            "block_s": None,
            "block_gap_s": None,
        },
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
