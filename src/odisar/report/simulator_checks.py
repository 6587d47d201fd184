"""Simulators in the report: whether they are plausible, and the ferry's against a sea trial.

The sea trial's file is no part of the project, so what it shows must not reach an output of the
pipeline: with it and without it, the pipeline makes the same bytes.
"""

import os
from pathlib import Path

import pandas as pd

from odisar.config.simulators import Simulator, SimulatorsConfig
from odisar.config.sources import PinnedFile
from odisar.report import overview
from odisar.report.exhibits import Drawn
from odisar.report.figures.simulator import office_map, sea_trial, standard_trials
from odisar.report.page import SeaTrial
from odisar.report.style import save_figure
from odisar.report.tables import Table
from odisar.simulators.robot.plausibility import map_traces
from odisar.simulators.robot.plausibility import plausibility_table as robot_plausibility
from odisar.simulators.vessel.plausibility import plausibility_table as vessel_plausibility
from odisar.simulators.vessel.plausibility import trial_traces
from odisar.simulators.vessel.validation import sea_trial_table, validation_traces

_CAPTION = (
    "The simulator's equations with R/V Gunnerus' parameters beside a part of her sea trial; the "
    "state is set to the measured one between manoeuvres."
)


def check_simulator(
    simulator: Simulator, config: SimulatorsConfig, folder: Path
) -> tuple[Table, Drawn]:
    """Return the table of a simulator's plausibility, and its figure (written into ``folder``)."""
    return _CHECKS[simulator](config, folder)


def _check_vessel(config: SimulatorsConfig, folder: Path) -> tuple[Table, Drawn]:
    checked = vessel_plausibility(config.vessel, config.seed)
    angles = checked.pop("angle_deg")
    at = angles.map(lambda angle: "" if pd.isna(angle) else f" at {angle:.0f} deg")
    table = overview.plausibility(
        "Plausibility of the simulated ferry",
        checked.assign(quantity=checked.quantity + at),
        "Turning circles and zigzags after IMO MSC.137(76), with the thruster angle in the place "
        "of the rudder angle, and the largest roll in any manoeuvre at strength 1.",
    )
    path = folder / "standard-trials.png"
    save_figure(
        standard_trials(trial_traces(config.vessel)), path, "The simulated ferry in calm water"
    )
    caption = "The simulated ferry in calm water: turning circles and zigzags at four angles."
    return table, Drawn("simulator", "", caption, path)


def _check_robot(config: SimulatorsConfig, folder: Path) -> tuple[Table, Drawn]:
    table = overview.plausibility(
        "Plausibility of the simulated robot",
        robot_plausibility(config.robot, config.seed),
        "Over undisturbed tasks; the ranges are those of an indoor base of its size.",
    )
    path = folder / "office-map.png"
    save_figure(office_map(map_traces(config.robot, config.seed)), path, "The simulated office")
    caption = "The office, and the paths of some undisturbed tasks with their waypoints."
    return table, Drawn("simulator", "", caption, path)


_CHECKS = {"vessel": _check_vessel, "robot": _check_robot}


def show_sea_trial(file: PinnedFile, root: Path, figure: Path) -> SeaTrial:
    """Return table and figure (written to ``figure``), or how to get the file."""
    trial = find_trial(file, root)
    if trial is None:
        advice = (
            "The simulator's equations can be held against a public sea trial of R/V Gunnerus, "
            f"which is not part of this project. Set {file.environment_variable} to a copy of "
            f"{file.file_name} ({file.credit}) or run `make real`, which downloads it; then "
            "`make report`."
        )
        return SeaTrial([], [], advice)
    save_figure(sea_trial(validation_traces(trial)), figure, "The vessel model and a sea trial")
    drawn = Drawn("sea-trial", "", _CAPTION, figure)
    return SeaTrial([overview.sea_trial(sea_trial_table(trial))], [drawn])


def find_trial(file: PinnedFile, root: Path) -> Path | None:
    """Return the sea trial's file if it is there already; nothing is downloaded.

    Looked for where the environment variable says, in this workspace, and in that of ``make real``.
    """
    named = os.environ.get(file.environment_variable, "").strip()
    below = Path(file.folder) / file.file_name
    places = [Path(named).expanduser()] if named else []
    places += [root / below, root / "workspaces/real" / below]
    return next((path for path in places if path.is_file()), None)
