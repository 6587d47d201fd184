"""The start of a recording, as far as a proposal needs it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from odisar.config.formats import CsvFormat
from odisar.errors import OdisarError
from odisar.proposals.tables import printable, shortened, table

#: No more of one file is looked at for a proposal; the quality check reads all of it.
HEAD_BYTES = 8 * 1024**2
HEAD_ROWS = 100_000


class UnusableError(OdisarError):
    """A file that tells nothing; the message says why and what to do."""


@dataclass(frozen=True)
class Sample:
    """The first rows of a recording: ``table`` has float columns, and text where there is text.

    ``obstacles`` say, by kind, what keeps the pipeline's reader from reading such a file, although
    it could be understood here; ``units`` stand in a line of their own below the header.
    ``remarks`` are worth a word.
    """

    path: Path
    table: pd.DataFrame
    layout: CsvFormat | None = None
    encoding: str = "utf-8-sig"
    header_line: int = 0
    units: Mapping[str, str] = field(default_factory=dict)
    obstacles: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    @property
    def columns(self) -> list[str]:
        """Names of all columns, in the order of the file."""
        return [str(name) for name in self.table.columns]

    @property
    def signature(self) -> tuple[object, ...]:
        """What files have in common that one declaration can read."""
        return (self.layout, self.encoding, self.header_line, tuple(self.obstacles))


def none_usable(faults: Sequence[tuple[str, str, str]]) -> str:
    """Return what is wrong with every file: (name, problem, what to do) where each is known."""
    if len(faults) == 1:
        name, problem, remedy = map(printable, faults[0])
        return f"{name}: {problem}" + (f"; {remedy}" if remedy else "")
    header = ("file", "problem", "what to do")
    shown = [(shortened(name, 40), problem, remedy) for name, problem, remedy in faults]
    width = 3 if any(remedy for _, _, remedy in shown) else 2
    rows = [row[:width] for row in shown]
    text = table(header[:width], rows, wrapped=tuple(range(1, width)))
    return f"none of the {len({name for name, _, _ in faults})} recordings can be read:\n{text}"


def names(items: list[str] | tuple[str, ...], shown: int = 6) -> str:
    """Return names for a sentence, quoted, the first of many and the number of the others."""
    rest = len(items) - shown
    text = ", ".join(f"'{item}'" for item in items[:shown])
    return f"{text} and {rest} more" if rest > 0 else text
