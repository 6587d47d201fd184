"""How well scores rank: ROC curves, exact, from every scored time of the test recordings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray
from sklearn.metrics import roc_curve

from odisar.evaluation.metrics import auroc
from odisar.evaluation.protocols import take_samples
from odisar.evaluation.scored import ScoredRecording
from odisar.report.detectors import MONITOR, detector_look, detector_name
from odisar.report.judged import judged_recordings
from odisar.report.load import Results
from odisar.report.picking import shown_detectors
from odisar.report.style import figure_style, row_of_panels

#: Left end of the logarithmic axis: one in a thousand undisturbed samples.
_SMALLEST_SHARE = 1e-3


@dataclass(frozen=True)
class Pooled:
    """Samples of several recordings: (sample,) labels, and scores by detector."""

    labels: NDArray[np.bool_]
    scores: dict[str, NDArray[np.float64]]


def roc_by_strength(results: Results, setup: str) -> Figure:
    """Draw ROC curves (P2) by strength or kind of fault: whole, and where false alarms are rare."""
    groups = judged_recordings(results, setup).disturbed
    detectors = shown_detectors(results.detection, setup)
    with figure_style():
        figure = Figure(figsize=(row_of_panels(len(groups)), 5.4))
        grid = figure.subplots(2, len(groups), squeeze=False, sharey=True, sharex="row")
        for (whole, rare), (name, recordings) in zip(grid.T, groups.items(), strict=True):
            samples = pool_samples(results, setup, recordings, detectors)
            _curves(whole, samples)
            _curves(rare, samples)
            _areas(whole, samples)
            whole.set_title(name)
        grid[0][0].set(xlim=(-0.02, 1), ylim=(0, 1.02))
        grid[1][0].set_xscale("log")
        grid[1][0].set_xlim(_SMALLEST_SHARE, 1)
        # The last would meet the next panel's first.
        grid[1][0].set_xticks([1e-3, 1e-2, 1e-1, 1], ["0.001", "0.01", "0.1", ""])
        figure.supylabel("share of disturbed samples above the threshold", fontsize=9)
        figure.supxlabel(
            "share of undisturbed samples above the threshold; below on a logarithmic axis",
            fontsize=9,
        )
        handles = [
            Line2D([], [], color=detector_look(d, detectors).colour, label=detector_name(d))
            for d in detectors
        ]
        handles += [
            Line2D([], [], color="#777777", ls=":", label="a coin"),
            Line2D([], [], ls="", label="numbers: AUROC [%]"),
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return figure


def pool_samples(
    results: Results,
    setup: str,
    recordings: Sequence[ScoredRecording],
    detectors: Sequence[str],
) -> Pooled:
    """Return what protocol P2 judges: samples of all recordings, in multiples of thresholds."""
    judging = results.judging(setup)
    parts = [take_samples(item, "P2", judging) for item in recordings]
    return Pooled(
        np.concatenate([part.labels for part in parts]),
        {name: np.concatenate([part.scores[name] for part in parts]) for name in detectors},
    )


def _curves(axes: Axes, samples: Pooled) -> None:
    detectors = list(samples.scores)
    even = np.geomspace(_SMALLEST_SHARE, 1, 200)
    axes.plot(even, even, color="#777777", linestyle=":", linewidth=0.9)
    for name, scores in samples.scores.items():
        false, true, _ = roc_curve(samples.labels, scores)
        # The monitor is broad: what runs along it stays visible on top.
        width = 2.6 if name == MONITOR else 1.1
        axes.plot(false, true, color=detector_look(name, detectors).colour, linewidth=width)


def _areas(axes: Axes, samples: Pooled) -> None:
    """Write each curve's area where curves that are better than a coin leave room."""
    detectors = list(samples.scores)
    for number, name in enumerate(reversed(detectors)):
        axes.text(
            0.97,
            0.04 + 0.085 * number,
            f"{100 * auroc(samples.scores[name], samples.labels):.1f}",
            color=detector_look(name, detectors).colour,
            transform=axes.transAxes,
            ha="right",
            fontsize=7.5,
            fontweight="bold",
        )
