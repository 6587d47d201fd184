"""Scores around the onset of events: the middle of all recordings, and how far they spread."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from odisar.evaluation.alarms import judge_events
from odisar.evaluation.labels import Event, merge_events
from odisar.evaluation.scored import ScoredRecording
from odisar.report.clock import span_unit
from odisar.report.detectors import MONITOR, RECONSTRUCTION, detector_look, detector_name
from odisar.report.judged import judged_recordings
from odisar.report.load import Results
from odisar.report.style import EVENT_COLOUR, figure_style, plain_logarithm, row_of_panels

_DETECTORS = (MONITOR, RECONSTRUCTION)
#: The band holds the recordings between these.
_LOW, _HIGH = 10.0, 90.0

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Envelope:
    """Scores around onsets, in multiples of the alarm threshold.

    ``since_s`` (time,) seconds since onset; ``low``, ``middle`` and ``high`` (time,) over events;
    ``delays_s`` (event,) how long each first alarm took, inf where there was none.
    """

    since_s: FloatArray
    low: FloatArray
    middle: FloatArray
    high: FloatArray
    delays_s: FloatArray


def score_around_onset(results: Results, setup: str) -> Figure:
    """Draw the monitor's and the paper's score, aligned at onset, by strength or kind of fault."""
    groups = judged_recordings(results, setup).disturbed
    case = results.case_of(setup)
    margin_s = case.window.context_steps / case.rate_hz
    with figure_style():
        figure = Figure(figsize=(row_of_panels(len(groups)), 4.8))
        grid = figure.subplots(len(_DETECTORS), len(groups), squeeze=False, sharey="row")
        for column, (name, recordings) in enumerate(groups.items()):
            lasts_s = float(np.median([e.end_s - e.onset_s for _, e in _events(recordings)]))
            unit, unit_s = span_unit(lasts_s + 2 * margin_s)
            for axes, detector in zip(grid[:, column], _DETECTORS, strict=True):
                found = envelope(
                    recordings, detector, (-margin_s, lasts_s + margin_s), case.persistence_s
                )
                _draw(axes, found, detector, unit_s)
                head = f"{name}\n" if detector == _DETECTORS[0] else ""
                axes.set_title(f"{head}{told_alarms(found.delays_s)}", fontsize=8)
                axes.axvspan(0, lasts_s / unit_s, color=EVENT_COLOUR, alpha=0.4, lw=0, zorder=0)
            grid[-1][column].set_xlabel(f"since onset [{unit}]")
        for axes in grid[:, 0]:
            axes.set_yscale("log")
            plain_logarithm(axes.yaxis)
        figure.supylabel("score [multiples of its alarm threshold]", fontsize=9)
        _legend(figure)
    return figure


def envelope(
    recordings: Sequence[ScoredRecording],
    detector: str,
    shown_s: tuple[float, float],
    persistence_s: float,
) -> Envelope:
    """Return median and 10-90 % band over the events of recordings that share a spacing.

    ``shown_s`` is the first and the last second around onset; an event gives a score wherever it
    has one there.
    """
    spacing_s = recordings[0].spacing_s
    steps = np.arange(np.ceil(shown_s[0] / spacing_s), np.floor(shown_s[1] / spacing_s) + 1)
    lines = []
    for item, event in _events(recordings):
        at = np.round((item.time_s - event.onset_s) / spacing_s) - steps[0]
        inside = (at >= 0) & (at < len(steps))
        line = np.full(len(steps), np.nan)
        ratio = item.scores[detector] / item.operating_thresholds[detector]
        line[at[inside].astype(int)] = ratio[inside]
        lines.append(line)
    values = np.array(lines)
    known = np.isfinite(values).any(axis=0)
    band = np.full((3, len(steps)), np.nan)
    band[:, known] = np.nanpercentile(values[:, known], (_LOW, 50.0, _HIGH), axis=0)
    outcomes = [o for item in recordings for o in judge_events(item, detector, persistence_s)]
    low, middle, high = band
    delays_s = np.array([outcome.delay_s for outcome in outcomes])
    return Envelope(steps * spacing_s, low, middle, high, delays_s)


def _events(recordings: Sequence[ScoredRecording]) -> list[tuple[ScoredRecording, Event]]:
    return [(item, event) for item in recordings for event in merge_events(item.intervals)]


def _draw(axes: Axes, found: Envelope, detector: str, unit_s: float) -> None:
    colour = detector_look(detector, _DETECTORS).colour
    since = found.since_s / unit_s
    axes.fill_between(since, found.low, found.high, color=colour, alpha=0.25, linewidth=0)
    axes.plot(since, found.middle, color=colour, linewidth=1.1)
    axes.axhline(1.0, color="#444444", linestyle=":", linewidth=1.0)
    axes.axvline(0.0, color="black", linewidth=0.8)
    detected = found.delays_s[np.isfinite(found.delays_s)]
    bottom = axes.get_xaxis_transform()
    axes.plot(
        detected / unit_s, np.full(len(detected), 0.04), "|", color="black", ms=7, transform=bottom
    )
    middle_s = _middle(found.delays_s)
    if np.isfinite(middle_s):
        axes.axvline(middle_s / unit_s, color="black", linestyle="--", linewidth=0.8)


def told_alarms(delays_s: FloatArray) -> str:
    """Return how many events raised an alarm, and the median delay if that is one of them."""
    middle_s = _middle(delays_s)
    text = f"{int(np.isfinite(delays_s).sum())} of {len(delays_s)} alarmed"
    return f"{text},\np50 {round(middle_s, 1):g} s" if np.isfinite(middle_s) else text


def _middle(delays_s: FloatArray) -> float:
    return float(np.quantile(delays_s, 0.5, method="inverted_cdf"))


def _legend(figure: Figure) -> None:
    handles: list[Line2D | Patch] = []
    for detector in _DETECTORS:
        colour = detector_look(detector, _DETECTORS).colour
        handles.append(Line2D([], [], color=colour, label=f"{detector_name(detector)}, median"))
        handles.append(Patch(facecolor=colour, alpha=0.25, label="10-90 % of events"))
    handles += [
        Line2D([], [], color="#444444", ls=":", label="alarm threshold"),
        Line2D([], [], color="black", ls="", marker="|", ms=8, label="first alarms"),
        Line2D([], [], color="black", ls="--", label="median alarm"),
        Patch(facecolor=EVENT_COLOUR, alpha=0.4, label="event"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4)
