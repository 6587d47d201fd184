"""How every figure looks, and how it becomes the same bytes each time."""

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import seaborn as sns
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from matplotlib_inline.backend_inline import set_matplotlib_formats
from numpy.typing import NDArray
from PIL import Image

#: Most abnormal last: the order in which shares are stacked.
QUADRANTS = ("green", "yellow", "orange", "red")
#: The paper's colours, in shades of different lightness; the hatches serve print and eyes that
#: do not tell red from green.
QUADRANT_COLOURS = {
    "green": "#2f9e5b",
    "yellow": "#f9e07f",
    "orange": "#f08a24",
    "red": "#a3142a",
}
QUADRANT_HATCHES = {"green": "", "yellow": "....", "orange": "////", "red": "xxxx"}

#: Shade of the time in which a disturbance is active.
EVENT_COLOUR = "#b8c4d6"

_DPI = 150
_PAGE_INCHES = 9.2
#: An axis from 1 to less than this has room for 2 and 5 in each decade.
_FEW_DECADES = 300.0
_LEGEND_INCHES = 7.4
_TITLE_INCHES = 0.32
#: Lines of a channel's name beside a panel: broken at spaces and underscores, inside of a word
#: only where it is longer than a line.
_LABEL_LINES = re.compile(r".{1,14}$|.{1,13}[ _]|.{1,14}")
_CHARACTER_INCHES = 0.078
_ROW_GAP_INCHES = 0.12
_SETTINGS: dict[Any, Any] = {
    "figure.dpi": 100,
    "figure.constrained_layout.use": True,
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "legend.fontsize": 8,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "hatch.linewidth": 0.5,
    "legend.frameon": False,
    # An axis that says "+2.8e7" in its corner is not read.
    "axes.formatter.useoffset": False,
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Apply the style to figures made inside."""
    with sns.axes_style("whitegrid", {"grid.color": "#e4e4e4"}), mpl.rc_context(_SETTINGS):
        yield


def use_figure_style() -> None:
    """Apply the style to all figures from now on, in a notebook."""
    sns.set_style("whitegrid", {"grid.color": "#e4e4e4"})
    mpl.rcParams.update(_SETTINGS)
    # The layout is constrained already; cutting to the ink would draw every figure twice.
    set_matplotlib_formats("png", bbox_inches=None)  # type: ignore[no-untyped-call]


def save_figure(figure: Figure, path: Path, title: str) -> None:
    """Write a PNG with a title above, which stands alone in MLflow and DVC; same bytes each time.

    The title is a strip of its own: matplotlib would draw it over a legend outside of the axes.
    256 colours, chosen for the figure, take a third of the bytes and can't be told from all of them
    by eye: figures are committed with the results, and the report holds each.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    strip = Figure(figsize=(figure.get_figwidth(), _TITLE_INCHES))
    strip.set_layout_engine("none")
    strip.text(0.5, 0.3, title, ha="center", fontsize=10.5, fontfamily="DejaVu Sans")
    image = np.concatenate([_pixels(strip), _pixels(figure)])
    palette = Image.fromarray(image).quantize(
        256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
    )
    palette.save(path, dpi=(_DPI, _DPI), optimize=True)


def _pixels(figure: Figure) -> NDArray[np.uint8]:
    canvas = FigureCanvasAgg(figure)
    figure.set_dpi(_DPI)
    canvas.draw()  # type: ignore[no-untyped-call]
    return np.asarray(canvas.buffer_rgba())[..., :3]  # type: ignore[no-untyped-call]


def channel_label(name: str, unit: str) -> str:
    """Return a channel's name in short lines, and its unit below, for an axis."""
    lines = [line.strip() for line in _LABEL_LINES.findall(name)]
    return "\n".join(lines if _holds_unit(name, unit) else [*lines, f"[{unit}]"])


def _holds_unit(name: str, unit: str) -> bool:
    """Whether a name has its unit in brackets or at its end; a letter there may be an axis."""
    if any(part in name for part in (f"[{unit}]", f"({unit})")):
        return True
    return (len(unit) > 1 or not unit.isalnum()) and re.split("[ _]", name)[-1] == unit


def row_inches(labels: Iterable[str], least: float = 1.05) -> float:
    """Return how high a row of a small multiple is, for the longest line of the rows' labels."""
    longest = max((len(line) for label in labels for line in label.split("\n")), default=0)
    return max(least, _CHARACTER_INCHES * longest + _ROW_GAP_INCHES)


def row_of_panels(panels: int) -> float:
    """Return how wide a figure with so many panels in a row is: at least as wide as a legend."""
    return max(_LEGEND_INCHES, min(2.4, max(1.55, _PAGE_INCHES / panels)) * panels + 0.6)


def plain_logarithm(axis: Axis) -> None:
    """Let a logarithmic axis say 0.5, 1 and 20 rather than powers of ten; call it when drawn on.

    Over many decades there is room for one number in each of them.
    """
    low, high = axis.get_view_interval()
    few = high < _FEW_DECADES * low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
