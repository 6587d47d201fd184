"""The price of being soon: delay of alarms against false alarms, over all thresholds."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from odisar.evaluation.alarms import AlarmCount, count_alarms, judge_events
from odisar.evaluation.intervals import weighted_quantile
from odisar.evaluation.scored import ScoredRecording
from odisar.report.detectors import MONITOR, detector_look, detector_name
from odisar.report.judged import Judged, judged_recordings, keep_detector
from odisar.report.load import Results
from odisar.report.picking import shown_detectors
from odisar.report.style import figure_style, plain_logarithm, row_of_panels

#: Thresholds tried between the first and the last of interest.
_THRESHOLDS = 24
#: Share of undisturbed samples above the lowest of them.
_SHARE_ABOVE = 0.1
#: Above this many false alarms per hour, nobody would look.
_MOST_PER_HOUR = 60.0

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Course:
    """What thresholds cost: (threshold,) false alarms per hour, and by group median delays.

    Thresholds are multiples of the operating one, which is the first; the others ascend. A delay
    is inf where the median event was not detected.
    """

    multiples: FloatArray
    per_hour: FloatArray
    delays_s: dict[str, FloatArray]


def delay_over_false_alarms(results: Results, setup: str) -> Figure:
    """Draw the median delay against false alarms per hour, by strength or kind of fault."""
    judged = judged_recordings(results, setup)
    detectors = shown_detectors(results.detection, setup)
    persistence_s = results.case_of(setup).persistence_s
    courses = {name: course(judged, name, persistence_s) for name in detectors}
    groups = list(judged.disturbed)
    hours = false_alarms(judged.undisturbed, detectors[0], persistence_s).hours
    with figure_style():
        figure = Figure(figsize=(row_of_panels(len(groups)), 3.5))
        grid = figure.subplots(1, len(groups), squeeze=False, sharey=True, sharex=True)[0]
        for axes, group in zip(grid, groups, strict=True):
            for name, found in courses.items():
                _line(axes, found, group, name, detectors)
            axes.axvline(
                results.config.evaluation.operating_point.promised_per_hour,
                color="black", ls="--", lw=0.8,
            )  # fmt: skip
            axes.set_title(group)
        # Counts from none on: linear up to one alarm in all hours, logarithmic from there.
        grid[0].set_xscale("symlog", linthresh=1 / hours)
        grid[0].set_yscale("log")
        grid[0].set_xlim(-0.25 / hours, _MOST_PER_HOUR)
        grid[0].xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        plain_logarithm(grid[0].yaxis)
        grid[0].set_ylabel("median delay after onset [s]")
        figure.supxlabel(f"false alarms per hour, in {hours:.1f} undisturbed hours", fontsize=9)
        handles = [
            Line2D(
                [], [], color=detector_look(d, detectors).colour, label=detector_name(d),
                marker=detector_look(d, detectors).marker, ms=5,
            )
            for d in detectors
        ]  # fmt: skip
        promised = Line2D([], [], color="black", ls="--", lw=0.8, label="promised")
        figure.legend(handles=[*handles, promised], loc="outside upper center", ncols=3)
    return figure


def course(judged: Judged, detector: str, persistence_s: float) -> Course:
    """Return false alarms and delays of a detector over its thresholds."""
    quiet = [keep_detector(item, detector) for item in judged.undisturbed]
    events = {
        name: [keep_detector(item, detector) for item in recordings]
        for name, recordings in judged.disturbed.items()
    }
    multiples = _multiples(quiet, detector)
    per_hour = [
        false_alarms(_at(quiet, detector, multiple), detector, persistence_s).per_hour
        for multiple in multiples
    ]
    delays = {
        name: np.array(
            [_median_delay(_at(own, detector, m), detector, persistence_s) for m in multiples]
        )
        for name, own in events.items()
    }
    return Course(multiples, np.array(per_hour), delays)


def false_alarms(
    recordings: Sequence[ScoredRecording], detector: str, persistence_s: float
) -> AlarmCount:
    """Return a detector's alarms in all of the recordings."""
    counts = [count_alarms(item, detector, persistence_s) for item in recordings]
    return reduce(AlarmCount.__add__, counts)


def _multiples(quiet: Sequence[ScoredRecording], detector: str) -> FloatArray:
    """Return multiples of the operating threshold: 1, then from many false alarms to none."""
    ratios = [item.scores[detector] / item.operating_thresholds[detector] for item in quiet]
    known = np.concatenate(ratios)
    known = known[np.isfinite(known)]
    low, high = np.quantile(known, 1 - _SHARE_ABOVE), known.max()
    smallest = np.finfo(np.float64).tiny
    between = np.geomspace(max(low, 1e-3 * high, smallest), max(high, smallest) * 1.5, _THRESHOLDS)
    return np.append(1.0, between)


def _at(
    recordings: Sequence[ScoredRecording], detector: str, multiple: float
) -> list[ScoredRecording]:
    return [
        replace(
            item,
            operating_thresholds={detector: multiple * item.operating_thresholds[detector]},
        )
        for item in recordings
    ]


def _median_delay(
    recordings: Sequence[ScoredRecording], detector: str, persistence_s: float
) -> float:
    outcomes = [o for item in recordings for o in judge_events(item, detector, persistence_s)]
    delays = np.array([outcome.delay_s for outcome in outcomes])
    return float(weighted_quantile(delays, np.ones((1, len(delays))), 0.5)[0])


def _line(axes: Axes, found: Course, group: str, name: str, detectors: Sequence[str]) -> None:
    """Draw the course of the thresholds, and the operating point as a marker with a dark rim."""
    look = detector_look(name, detectors)
    delays = np.where(np.isfinite(found.delays_s[group]), found.delays_s[group], np.nan)
    # The monitor is broad: what runs along it stays visible on top.
    width = 2.4 if name == MONITOR else 1.1
    axes.plot(found.per_hour[1:], delays[1:], color=look.colour, linewidth=width)
    axes.plot(
        found.per_hour[0], delays[0], look.marker, color=look.colour, ms=7, mec="black", mew=0.7,
        zorder=4, clip_on=False,
    )  # fmt: skip
