"""Tables that answer the paper's questions: effectiveness, confidence, against alternatives."""

from collections.abc import Sequence
from typing import Any

import pandas as pd

from odisar.evaluation.leakage_probes import CONTROL
from odisar.report.detectors import (
    FORECAST_ERRORS,
    MONITOR,
    RECONSTRUCTION,
    WITHOUT_TRANSFORMER,
    detector_name,
)
from odisar.report.figures.forecasting import ALL_STEPS, forecaster_name
from odisar.report.figures.leakage import probed
from odisar.report.figures.pairs import pairs_of
from odisar.report.figures.reliability import ALL_STATES, DISTRIBUTION_NAMES
from odisar.report.gains import signed
from odisar.report.load import Results, rows_of
from odisar.report.names import METRIC_NAMES, SHARES, strength_name
from odisar.report.picking import same_strength, shown_detectors
from odisar.report.tables import Table, metric_cell, number, published_beside

_COVERAGES = ("0.5", "0.8", "0.9", "0.95")
RULE_NAMES = {
    "sigma": "mean + k sigma (the paper's)",
    "log-sigma": "the same of log scores",
    "operating": "alarm rate on calibration",
    "conformal": "conformal, by blocks",
}


def effectiveness(results: Results, setup: str) -> Table:
    """Return the paper's table for RQ1: the monitor and the paper's score, scenario by scenario."""
    return _beside_published(
        results,
        setup,
        (MONITOR, RECONSTRUCTION),
        "RQ1",
        "Published numbers are the paper's ODiSAR; its score is our reconstruction, made causal.",
    )


def against_forecast_errors(results: Results, setup: str) -> Table:
    """Return the paper's table for RQ3: the scores beside the errors of the twin's forecasts."""
    wanted = (MONITOR, WITHOUT_TRANSFORMER, RECONSTRUCTION, *FORECAST_ERRORS)
    return _beside_published(
        results, setup, wanted, "RQ3", "The paper's baseline is the RMSE of the whole forecast."
    )


def _beside_published(
    results: Results, setup: str, detectors: Sequence[str], question: str, note: str
) -> Table:
    """Return detection by scenario at the greatest strength under P2, beside the published."""
    strongest = results.strengths(setup)[-1]
    scenarios = results.scenarios(setup)
    order = list(scenarios[~scenarios.is_apart].evaluated_on)
    rows = results.detection
    rows = rows[(rows.setup == setup) & (rows.protocol == "P2") & rows.detector.isin(detectors)]
    title = f"{question}, {setup}: by scenario under P2"
    title += "" if pd.isna(strongest) else f", strength {strength_name(strongest)}"
    same = same_strength(rows, strongest)
    note = note if same.published.notna().any() else ""
    return published_beside(title, same, order, note)


def rules(results: Results, setup: str) -> list[Table]:
    """Return what each rule for a threshold gave: of the monitor, and folded of the others."""
    table = results.rules[results.rules.setup == setup]
    own = table[table.detector == MONITOR]
    others = [name for name in shown_detectors(results.detection, setup) if name != MONITOR]
    note = (
        "A promise of the rule 'alarm rate' is one per hour of calibration recordings. That of the "
        "conformal rule holds per block of time, not per hour: so many fresh blocks stay without "
        "an alarm, and alarms that come in bursts break the rate it stands for. F1 is of single "
        "scores above the threshold, events and delay are of alarms that lasted."
    )
    return [
        _rule_table(f"{setup}: thresholds by rule", own, note),
        _rule_table(
            f"{setup}: thresholds by rule, other detectors",
            table[table.detector.isin(others)],
            folded=True,
        ),
    ]


def _rule_table(title: str, rows: pd.DataFrame, note: str = "", *, folded: bool = False) -> Table:
    lines = [
        [
            detector_name(row.detector),
            RULE_NAMES.get(row.rule, row.rule),
            "by fold" if pd.isna(row.threshold) else number(row.threshold),
            number(row.promised_per_hour),
            metric_cell(row.measured_per_hour, row.ci_low, row.ci_high, ""),
            number(row.hours),
            metric_cell(row.recordings_alarmed, float("nan"), float("nan"), "auroc"),
            strength_name(row.strength),
            *(_share(value) for value in (row.f1_ood, row.f1_ind)),
            f"{_share(row.events_detected)} of {number(row.events)}",
            number(row.delay_p50_s),
        ]
        for row in rows_of(rows)
    ]
    heads = [
        "detector",
        "rule",
        "threshold",
        "promised per hour",
        "false alarms per hour",
        "undisturbed hours",
        "recordings with a false alarm %",
        "strength",
        "F1 OOD %",
        "F1 IND %",
        "events detected %",
        "delay p50 [s]",
    ]
    return Table(title, heads, lines, note, folded)


def forecasts(results: Results, setup: str) -> Table:
    """Return the errors of the twin's forecasts and of simpler ones, over all steps."""
    table = results.forecast
    table = table[(table.setup == setup) & (table.step == ALL_STEPS)]
    lines = [
        [
            forecaster_name(row.forecaster),
            "known" if row.commands == "known-ahead" else "unknown",
            "all (scaled)" if row.state == ALL_STATES else row.state,
            number(row.rmse)
            if pd.isna(row.ci_low)
            else f"{number(row.rmse)} [{number(row.ci_low)}, {number(row.ci_high)}]",
            number(row.rmse_physical),
            number(row.skill),
        ]
        for row in rows_of(table.sort_values("state", key=lambda s: s != ALL_STATES, kind="stable"))
    ]
    heads = ["forecaster", "commands of the horizon", "state", "RMSE, scaled"]
    heads += ["RMSE, in the state's unit", "skill"]
    note = (
        "Undisturbed test recordings, all steps of the horizon, with 95 % intervals. Skill is 1 - "
        "MSE / MSE of persistence. The file has every step."
    )
    return Table(f"{setup}: errors of forecasts", heads, lines, note, folded=True)


def _share(value: float) -> str:
    return metric_cell(value, float("nan"), float("nan"), "auroc")


def reliability(results: Results, setup: str) -> list[Table]:
    """Return coverage, miscalibration, sharpness and CRPS: over all states, and of each."""
    table = results.reliability[results.reliability.setup == setup]
    whole = table[table.state == ALL_STATES]
    heads = [f"in the central {100 * float(c):g} % interval" for c in _COVERAGES]
    heads += ["miscalibration area", "mean standard deviation", "CRPS"]
    metrics = [*(f"coverage-{c}" for c in _COVERAGES), "miscalibration", "sharpness", "crps"]
    note = (
        "Truths inside the central intervals in percent; the area between reliability curve and "
        "diagonal (0 is perfect); mean standard deviation and CRPS in scaled units, less is "
        "better. Undisturbed test recordings, windows that do not overlap."
    )
    title = f"{setup}: how far forecasts can be trusted"
    physical = ["sharpness-physical", "crps-physical"]
    by_state = table[table.metric.isin([*metrics, *physical]) & (table.state != ALL_STATES)]
    units = {channel.name: channel.unit for channel in results.case_of(setup).channels}
    names = [*metrics[:5], *physical]
    return [
        Table(title, ["forecast", *heads], _reliability_lines(whole, metrics), note),
        Table(
            f"{title}, state by state",
            ["state", "unit", "forecast", *heads],
            [
                [state, units.get(state, ""), *line]
                for state in dict.fromkeys(by_state.state)
                for line in _reliability_lines(by_state[by_state.state == state], names)
            ],
            "Standard deviation and CRPS in the state's unit.",
            folded=True,
        ),
    ]


def _reliability_lines(rows: pd.DataFrame, metrics: Sequence[str]) -> list[list[str]]:
    lines = []
    for name in dict.fromkeys(rows.distribution):
        values = rows[rows.distribution == name].set_index("metric")
        cells = []
        for metric in metrics:
            if metric not in values.index:
                cells.append("-")
                continue
            value, low, high = values.loc[metric, ["value", "ci_low", "ci_high"]]
            share = metric.startswith("coverage")
            cells.append(metric_cell(value, low, high, "auroc") if share else number(value))
        lines.append([DISTRIBUTION_NAMES.get(name, name), *cells])
    return lines


def pairs(results: Results, setup: str) -> Table:
    """Return ODiSAR minus every other detector with paired intervals."""
    rows = pairs_of(results, setup)
    metrics = list(dict.fromkeys(rows.metric))
    lines = []
    for (other, strength), part in rows.groupby(["other", "strength"], sort=False, dropna=False):
        by_metric = part.set_index("metric")
        cells = []
        for metric in metrics:
            row: Any = by_metric.loc[metric]
            cells.append(_difference_cell(row, 100 if metric in SHARES else 1))
        lines.append([detector_name(str(other)), strength_name(float(str(strength))), *cells])
    heads = [f"{METRIC_NAMES[m]}{' [points]' if m in SHARES else ''}" for m in metrics]
    note = (
        "Paired bootstrap over recordings, P2, overall. Above zero ODiSAR is better, of a delay "
        "below zero. A star marks the best of the other detectors."
    )
    title = f"{setup}: ODiSAR minus each other detector"
    return Table(title, ["other", "strength", *heads], lines, note, folded=True)


def _difference_cell(row: Any, scale: int) -> str:
    if pd.isna(row.difference):
        return "-"
    text = f"{signed(scale * row.difference)}{' *' if row.is_next_best else ''}"
    if pd.isna(row.ci_low) or pd.isna(row.ci_high):
        return text
    return f"{text} [{signed(scale * row.ci_low)}, {signed(scale * row.ci_high)}]"


def blame(results: Results, setup: str) -> Table:
    """Return how often the guilty channel was named, beside chance."""
    rows = results.blame[results.blame.setup == setup]
    lines = [
        [
            row.fault,
            row.guilty,
            f"by {detector_name(row.attribution)}",
            f"{row.windows} of {row.recordings}",
            *(
                cell
                for top in (1, 3)
                for cell in (
                    metric_cell(
                        getattr(row, f"hit_{top}"),
                        getattr(row, f"hit_{top}_low"),
                        getattr(row, f"hit_{top}_high"),
                        "auroc",
                    ),
                    _share(getattr(row, f"chance_{top}")),
                )
            ),
        ]
        for row in rows_of(rows)
    ]
    heads = ["fault", "guilty channel", "blame", "flagged windows, of recordings"]
    heads += ["first %", "by chance %", "among three %", "by chance %"]
    return Table(f"{setup}: is the guilty channel named?", heads, lines, folded=True)


def leakage(results: Results, setup: str) -> Table:
    """Return what the leakage probes found of every detector."""
    lines = [
        [
            detector_name(row.detector),
            row.probe,
            f"{row.moved} of {row.positions}",
            number(row.share_of_iqr),
            "must move" if row.probe == CONTROL else "may not move",
            "yes" if row.passed else "no",
        ]
        for row in rows_of(probed(results, setup))
    ]
    heads = [
        "detector",
        "probe",
        "tries that moved the score",
        "largest move [IQR]",
        "rule",
        "kept",
    ]
    return Table(f"{setup}: leakage probes", heads, lines, folded=True)
