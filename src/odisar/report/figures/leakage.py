"""What the leakage probes found: which changes moved a score that must not, and which must."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from odisar.evaluation.leakage_probes import CONTROL
from odisar.report.detectors import detector_name
from odisar.report.load import Results, rows_of
from odisar.report.style import figure_style

#: By probe, what was done.
PROBE_NAMES = {
    "repeat": "asked\nagain",
    "future": "future\nchanged",
    "truncation": "recording\nends at t",
    "batch": "other\nrecordings\nchanged",
    "labels": "labels\nchanged",
    CONTROL: "sample at t\nchanged\n(must move)",
}
_RIGHT, _WRONG = "#dbe9f6", "#F5B98A"


def probed(results: Results, setup: str) -> pd.DataFrame:
    """Return a row for each detector and probe, folds summed; the study's detectors last.

    ``passed`` says whether the score did what it should.
    """
    rows = [results.leakage]
    study = results.study("leakage")
    if study is not None:
        rows.append(study[~study.detector.isin(results.leakage.detector)])
    table = pd.concat(rows)
    table = table[table.setup == setup]
    summed = (
        table.groupby(["detector", "probe"], sort=False)
        .agg(
            moved=("moved", "sum"),
            positions=("positions", "sum"),
            share_of_iqr=("share_of_iqr", "max"),
        )
        .reset_index()
    )
    wanted = np.where(summed.probe == CONTROL, summed.positions, 0)
    return summed.assign(passed=summed.moved == wanted)


def leakage_panel(results: Results, setup: str) -> Figure:
    """Draw detectors by probes: in how many tries the score moved, and how far at most."""
    table = probed(results, setup)
    detectors = list(dict.fromkeys(table.detector))
    probes = [name for name in PROBE_NAMES if name in set(table.probe)]
    with figure_style():
        figure = Figure(figsize=(9.2, 0.31 * len(detectors) + 1.4))
        axes = figure.subplots()
        for row in rows_of(table):
            x, y = probes.index(str(row.probe)), detectors.index(str(row.detector))
            axes.add_patch(
                Rectangle(
                    (x - 0.5, y - 0.5), 1, 1, facecolor=_RIGHT if row.passed else _WRONG,
                    hatch="" if row.passed else "///", edgecolor="white", linewidth=1.0,
                )
            )  # fmt: skip
            axes.text(x, y, _told(row), ha="center", va="center", fontsize=7)
        axes.set_xticks(range(len(probes)), [PROBE_NAMES[name] for name in probes])
        axes.set_yticks(range(len(detectors)), [detector_name(name) for name in detectors])
        axes.set_xlim(-0.5, len(probes) - 0.5)
        axes.set_ylim(len(detectors) - 0.5, -0.5)
        axes.grid(visible=False)
        axes.tick_params(length=0)
        axes.xaxis.tick_top()
        handles = [
            Patch(facecolor=_RIGHT, label="as it should"),
            Patch(facecolor=_WRONG, hatch="///", edgecolor="white", label="not as it should"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _told(row: Any) -> str:
    told = f"moved {row.moved} of {row.positions}"
    share = float(row.share_of_iqr)
    if not row.moved or not np.isfinite(share):
        return told
    return f"{told},\n{share:.0f} IQR" if share >= 10 else f"{told},\n{share:.2g} IQR"
