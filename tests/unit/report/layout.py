"""Which titles, labels and legends of a figure lie over one another."""

from collections.abc import Iterator
from itertools import combinations

from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

#: Boxes of text have a rim; two that only touch are apart [pixels].
_RIM = 1.0


def overlaps(figure: Figure) -> list[str]:
    """Return the pairs that overlap, and what is cut off at the figure's edge."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    boxes = list(_boxes(figure, canvas))
    page = figure.bbox.padded(_RIM)
    cut = [
        f"{name!r} is cut off"
        for name, box in boxes
        if not (page.contains(*box.min) and page.contains(*box.max))
    ]
    pairs = combinations(boxes, 2)
    return cut + [f"{a!r} and {b!r}" for (a, one), (b, two) in pairs if _meet(one, two)]


def _meet(one: Bbox, two: Bbox) -> bool:
    both = Bbox.intersection(one, two)
    return both is not None and both.width > _RIM and both.height > _RIM


def _boxes(figure: Figure, canvas: FigureCanvasAgg) -> Iterator[tuple[str, Bbox]]:
    renderer = canvas.get_renderer()
    for legend in figure.legends:
        yield "legend", legend.get_window_extent(renderer)
    shown = [axes for axes in figure.axes if axes.get_visible()]
    texts = [*figure.texts, *(axes.title for axes in shown)]
    for axes in shown:
        texts += [axes.xaxis.label, axes.yaxis.label]
        for axis in (axes.xaxis, axes.yaxis):
            yield from _ticks(axis, canvas)
    for text in texts:
        if text.get_visible() and text.get_text():
            yield text.get_text(), text.get_window_extent(renderer)


def _ticks(axis: Axis, canvas: FigureCanvasAgg) -> Iterator[tuple[str, Bbox]]:
    """Yield an axis's tick labels as one box: slanted ones have boxes that overlap each other."""
    labels = [label for label in axis.get_ticklabels() if label.get_visible() and label.get_text()]
    low, high = sorted(axis.get_view_interval())
    places = dict(zip(axis.get_ticklabels(), axis.get_ticklocs(), strict=False))
    inside = [label for label in labels if low <= places.get(label, low) <= high]
    if inside:
        yield (
            "tick labels",
            Bbox.union([i.get_window_extent(canvas.get_renderer()) for i in inside]),
        )
