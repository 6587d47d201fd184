"""The published figures, for the column beside our own.

``published.csv`` is the paper's table of detection performance (its label: rq1-results-merged) as
fractions; ``published_quadrants.csv`` is what its text says about RQ2. They were obtained with
other data and another protocol; the table shows them for comparison, not as a yardstick.
"""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import product

import pandas as pd

from odisar.evaluation.cells import OVERALL

#: The protocols beside which published figures stand.
PUBLISHED_PROTOCOLS = ("P1", "P2")

#: Published disturbances are those at this strength; recordings without a strength are taken as so.
FULL_STRENGTH = 1.0

#: Detectors beside which a published one stands. The paper's score is our ``reconstruction``; what
#: it published as its monitor is also what our monitor is held against.
_STAND_IN = {"odisar": ("odisar", "reconstruction")}

_Key = tuple[str, str, str, str]


def _rows(name: str) -> list[dict[str, str]]:
    text = files("odisar.evaluation").joinpath(name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


@cache
def published_values() -> Mapping[_Key, float]:
    """Return the published figures by (set-up, evaluated on, detector, metric), as fractions.

    A set-up published on a single manoeuvre has no row for all data; its one row is that. The
    published monitor stands beside two of our detectors.
    """
    rows = _rows("published.csv")
    scenarios: dict[str, set[str]] = {}
    for row in rows:
        scenarios.setdefault(row["setup"], set()).add(row["evaluated_on"])
    values: dict[_Key, float] = {}
    for row in rows:
        names = [row["evaluated_on"]]
        names += [OVERALL] if len(scenarios[row["setup"]]) == 1 else []
        detectors = _STAND_IN.get(row["detector"], (row["detector"],))
        for name, detector in product(names, detectors):
            values[row["setup"], name, detector, row["metric"]] = float(row["value"])
    return values


@dataclass(frozen=True)
class PublishedShare:
    """A published share of a quadrant as a range of fractions, and the paper's statement."""

    low: float
    high: float
    statement: str


@cache
def published_shares() -> Mapping[tuple[str, str], PublishedShare]:
    """Return the published shares by (set-up, quadrant)."""
    return {
        (row["setup"], row["quadrant"]): PublishedShare(
            float(row["low"]), float(row["high"]), row["statement"]
        )
        for row in _rows("published_quadrants.csv")
    }


def is_full_strength(strength: float) -> bool:
    """Whether a table's strength is the published one: full, or none at all."""
    return pd.isna(strength) or strength == FULL_STRENGTH
