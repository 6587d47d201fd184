"""The operating point: false alarms against the promise, events found, how soon."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from odisar.report.detectors import detector_look, detector_name
from odisar.report.load import OVERALL, Results, rows_of
from odisar.report.names import strength_name
from odisar.report.picking import shown_detectors
from odisar.report.style import figure_style


def operating_point(results: Results, setup: str) -> Figure:
    """Draw false alarms, events detected, delay and lead time of the alarms with persistence."""
    table = results.detection
    table = table[(table.setup == setup) & (table.evaluated_on == OVERALL)]
    table = table[table.protocol == "P2"]
    with figure_style():
        figure = Figure(figsize=(9.6, 3.2))
        alarms, detected, delay, lead = figure.subplots(1, 4)
        _false_alarms(alarms, results, setup)
        _over_strength(detected, results, setup, table, ("events_detected",), scale=100)
        detected.set_ylim(-3, 103)
        detected.set_title("events detected [%]")
        _over_strength(delay, results, setup, table, ("delay_p50_s", "delay_p90_s"))
        delay.set_title("delay [s]: p50 filled,\np90 hollow")
        _say_if_empty(delay, "fewer than half detected:\nno median delay")
        delay.set_ylim(bottom=-0.03 * delay.get_ylim()[1])
        _over_strength(lead, results, setup, table, ("lead_time_p50_s",))
        _say_if_empty(lead, "no median lead time")
        lead.axhline(0, color="black", linewidth=0.7)
        lead.set_title("median lead time before\na consequence [s]")
        handles, labels = detected.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
    return figure


def _false_alarms(axes: Axes, results: Results, setup: str) -> None:
    detectors = shown_detectors(results.detection, setup)
    rows = results.operating[results.operating.setup == setup]
    rows = rows[rows.detector.isin(detectors)]
    for place, row in enumerate(rows_of(rows)):
        rate = float(row.false_alarms_per_hour)
        axes.errorbar(
            place,
            rate,
            yerr=[[rate - float(row.ci_low)], [float(row.ci_high) - rate]],
            fmt=detector_look(row.detector, detectors).marker,
            color=detector_look(row.detector, detectors).colour,
            elinewidth=1.3,
            markersize=4.5,
        )
    promised = results.config.evaluation.operating_point.promised_per_hour
    axes.axhline(promised, color="black", linestyle="--", linewidth=0.9)
    axes.set_xticks([])
    axes.set_xlim(-0.6, len(rows) - 0.4)
    axes.set_ylim(bottom=-0.03 * axes.get_ylim()[1])
    hours = rows.hours.max() if len(rows) else 0.0
    axes.set_title(f"false alarms per hour in {hours:.1f} h\n(dashed: promised)")


def _over_strength(
    axes: Axes,
    results: Results,
    setup: str,
    table: pd.DataFrame,
    metrics: tuple[str, ...],
    scale: float = 1.0,
) -> None:
    strengths = results.strengths(setup)
    detectors = shown_detectors(results.detection, setup)
    width = 0.6 / len(detectors)
    for number, detector in enumerate(detectors):
        for metric, fill in zip(metrics, ("full", "none"), strict=False):
            rows = table[(table.detector == detector) & (table.metric == metric)]
            rows = rows[rows.value.notna()]
            at = np.array([_place(strengths, strength) for strength in rows.strength])
            values = scale * rows.value.to_numpy()
            below = values - scale * rows.ci_low.fillna(rows.value).to_numpy()
            above = scale * rows.ci_high.fillna(rows.value).to_numpy() - values
            bars = np.clip([below, above], 0, None) if fill == "full" else None
            axes.errorbar(
                at + (number - (len(detectors) - 1) / 2) * width,
                values,
                yerr=bars,
                fmt=detector_look(detector, detectors).marker,
                fillstyle=fill,
                color=detector_look(detector, detectors).colour,
                elinewidth=1.3,
                markersize=4.5,
                label=detector_name(detector) if fill == "full" else None,
            )
    axes.set_xticks(range(len(strengths)), [strength_name(s) for s in strengths])
    axes.set_xlim(-0.5, len(strengths) - 0.5)
    axes.grid(visible=False, axis="x")
    if pd.notna(strengths[-1]):
        axes.set_xlabel("strength")


def _say_if_empty(axes: Axes, text: str) -> None:
    if not any(np.asarray(line.get_xdata()).size for line in axes.lines):
        axes.set_yticks([])
        axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", size=8)


def _place(strengths: list[float], strength: float) -> int:
    return 0 if pd.isna(strength) else strengths.index(strength)
