"""The list of figures: what each shows, where it stands in the report, and drawing them all."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from matplotlib.figure import Figure

from odisar.report.figures.baselines import (
    baselines_by_scenario,
    baselines_by_strength,
    components_apart,
    has_components,
    has_groups,
    has_strengths,
    protocols,
)
from odisar.report.figures.events import (
    attribution_shares,
    event_attribution,
    fault_heat_map,
    forecast_examples,
    has_faults,
    has_flagged,
)
from odisar.report.figures.learning import training_curves, tuning_trials
from odisar.report.figures.operating import operating_point
from odisar.report.figures.quadrants import (
    has_quadrants,
    quadrant_distribution,
    quadrant_scatter,
)
from odisar.report.figures.recordings import recordings_overview
from odisar.report.load import Results
from odisar.report.picking import lead_time_note
from odisar.report.style import save_figure

Section = Literal[
    "detection",
    "protocols",
    "quadrants",
    "events",
    "recordings",
    "learning",
    "simulator",
    "sea-trial",
]


@dataclass(frozen=True)
class Plate:
    """One figure, drawn for every set-up or for every case, if it applies.

    ``note`` adds to the caption what holds for one subject only.
    """

    name: str
    title: str
    section: Section
    caption: str
    draw: Callable[[Results, str], Figure]
    scope: Literal["setup", "case"] = "setup"
    applies: Callable[[Results, str], bool] = lambda _results, _subject: True
    note: Callable[[Results, str], str] = lambda _results, _subject: ""


@dataclass(frozen=True)
class Drawn:
    """A figure on disk, with what the report says below it."""

    section: Section
    subject: str
    caption: str
    path: Path


PLATES = (
    Plate(
        "baselines-by-strength",
        "Detection by strength of the disturbance (P2)",
        "detection",
        "Detection by strength of the disturbance under P2 (the score at t against 'disturbed at "
        "t'). Hollow diamonds, if any: published, with other data and another protocol.",
        baselines_by_strength,
        applies=has_strengths,
    ),
    Plate(
        "baselines-by-scenario",
        "Detection by scenario (P2)",
        "detection",
        "Detection by scenario under P2, at the greatest strength if there are several.",
        baselines_by_scenario,
        applies=has_groups,
    ),
    Plate(
        "apart",
        "Judged apart from the overall rows (P2)",
        "detection",
        "What is left out of the overall rows and judged apart, beside the overall at the same "
        "strength (P2). Groups that are disturbed from end to end are ranked against the "
        "undisturbed test recordings.",
        components_apart,
        applies=has_components,
    ),
    Plate(
        "fault-heat-map",
        "Share of faulty time that is flagged",
        "detection",
        "Share of the faulty time with a score above its threshold, by fault and channel.",
        fault_heat_map,
        applies=has_faults,
    ),
    Plate(
        "operating-point",
        "Alarms at the operating point",
        "detection",
        "Alarms at the operating point: false alarms with exact Poisson intervals, events found, "
        "delay after onset, and median time from alarm to consequence (below zero: too late).",
        operating_point,
        note=lead_time_note,
    ),
    Plate(
        "protocols",
        "The same scores under four protocols",
        "protocols",
        "The same scores under four protocols, at the greatest strength if there are several. The "
        "oracle knows whether "
        "a disturbance is active now and nothing of the future; under P1 it cannot be perfect.",
        protocols,
    ),
    Plate(
        "quadrants",
        "Confidence quadrants by scenario",
        "quadrants",
        "Share of assessed windows in each confidence quadrant. Windows of disturbed recordings "
        "before, in and after the event count, as published.",
        quadrant_distribution,
        applies=has_quadrants,
    ),
    Plate(
        "quadrant-scatter",
        "Every assessed window by error and variance",
        "quadrants",
        "Every assessed window of the test recordings: right of the dashed line is OOD, above the "
        "dotted line is uncertain. If the variance told disturbed from undisturbed windows, the "
        "right panel's points would lie higher.",
        quadrant_scatter,
    ),
    Plate(
        "forecasts",
        "Forecasts before, soon after and in an event",
        "events",
        "Forecasts issued just before the event, soon after its onset and in its middle, with "
        "what was recorded. The recorded future is drawn for comparison; the twin never sees it.",
        forecast_examples,
    ),
    Plate(
        "event",
        "One event: score, quadrants, blamed states",
        "events",
        "One event: the score as it was known at each time, the quadrant of each assessed window, "
        "and the states blamed in windows flagged as OOD. Quadrant and blame are drawn over the "
        "forecast's horizon.",
        event_attribution,
    ),
    Plate(
        "attribution",
        "States that flagged windows blame",
        "events",
        "Which states the flagged windows blame, at the greatest strength if there are several.",
        attribution_shares,
        applies=has_flagged,
    ),
    Plate(
        "recordings",
        "A disturbed and an undisturbed test recording",
        "recordings",
        "Every channel of one disturbed and one undisturbed test recording; commands in grey.",
        recordings_overview,
        scope="case",
    ),
    Plate(
        "training",
        "Training: forecast and reconstruction error",
        "learning",
        "Training of each twin. The twin with the lowest validation forecast error is kept.",
        training_curves,
    ),
)


def draw_figures(results: Results, folder: Path) -> list[Drawn]:
    """Draw every figure that applies into an emptied folder, as ``<name>-<subject>.png``."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.png"):
        old.unlink()
    drawn = []
    for plate in PLATES:
        subjects = results.setups if plate.scope == "setup" else results.cases
        for subject in subjects:
            if plate.applies(results, subject):
                path = folder / f"{plate.name}-{subject}.png"
                save_figure(plate.draw(results, subject), path, f"{plate.title}: {subject}")
                caption = f"{plate.caption} {plate.note(results, subject)}".strip()
                drawn.append(Drawn(plate.section, subject, caption, path))
    path = folder / "tuning-trials.png"
    save_figure(tuning_trials(results), path, "Tuning trials of each set-up")
    caption = "Every tuning trial's validation forecast error; no disturbed recording is looked at."
    if any(len(results.tuning(setup)) > 1 for setup in results.setups):
        caption += " Each fold has a study of its own; their trials stand side by side."
    drawn.append(Drawn("learning", "", caption, path))
    return drawn
