"""What a figure of the report is: drawn when it applies, with words below it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from matplotlib.figure import Figure

from odisar.report.load import Results

#: Parts of the report in which figures stand; the first three answer the paper's questions.
Section = Literal[
    "effectiveness",
    "confidence",
    "alternatives",
    "protocols",
    "events",
    "recordings",
    "learning",
    "simulator",
    "sea-trial",
]


@dataclass(frozen=True)
class Plate:
    """One figure, drawn for every set-up or for every case, if it applies.

    ``note`` adds to the caption what holds for one subject only.
    """

    name: str
    title: str
    section: Section
    caption: str
    draw: Callable[[Results, str], Figure]
    scope: Literal["setup", "case"] = "setup"
    applies: Callable[[Results, str], bool] = lambda _results, _subject: True
    note: Callable[[Results, str], str] = lambda _results, _subject: ""


@dataclass(frozen=True)
class Drawn:
    """A figure on disk, with what the report says below it."""

    section: Section
    subject: str
    caption: str
    path: Path
