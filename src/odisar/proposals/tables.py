"""Tables for a terminal: no wider than 120 columns, long cells on several lines."""

import textwrap
from collections.abc import Sequence

WIDTH = 118
_GAP = "  "


def table(header: Sequence[str], rows: Sequence[Sequence[str]], wrapped: Sequence[int] = ()) -> str:
    """Return rows below a header; the columns numbered in ``wrapped`` share what width is left."""
    cells = [[printable(cell) for cell in row] for row in (header, *rows)]
    widths = [max(1, *(len(row[i]) for row in cells)) for i in range(len(header))]
    widths = _fitted(widths, wrapped)
    lines = [line for row in cells for line in _lines(row, widths)]
    height = len(_lines(cells[0], widths))
    lines.insert(height, _GAP.join("-" * width for width in widths))
    return "\n".join(lines)


def _fitted(widths: list[int], wrapped: Sequence[int]) -> list[int]:
    room = WIDTH - len(_GAP) * (len(widths) - 1)
    fixed = sum(width for i, width in enumerate(widths) if i not in wrapped)
    share = max((room - fixed) // max(len(wrapped), 1), 12)
    wide = [i for i in wrapped if widths[i] > share]
    spare = sum(share - widths[i] for i in wrapped if widths[i] <= share)
    return [share + spare // len(wide) if i in wide else width for i, width in enumerate(widths)]


def _lines(row: Sequence[str], widths: Sequence[int]) -> list[str]:
    parts = [
        textwrap.wrap(cell, width, break_on_hyphens=False) or [""]
        for cell, width in zip(row, widths, strict=True)
    ]
    height = max(map(len, parts))
    padded = [part + [""] * (height - len(part)) for part in parts]
    return [
        _GAP.join(part[i].ljust(width) for part, width in zip(padded, widths, strict=True)).rstrip()
        for i in range(height)
    ]


def printable(text: str) -> str:
    """Return text without what a file could steer a terminal with."""
    return "".join(sign if sign.isprintable() else "?" for sign in text)


def shortened(text: str, width: int) -> str:
    """Return a text no longer than so many characters: its start and its end."""
    if len(text) <= width:
        return text
    end = (width - 3) // 2
    return f"{text[: width - 3 - end]}...{text[len(text) - end :]}"
