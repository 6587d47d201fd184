"""The vessel simulator's part of the report: plausibility, and the sea trial if it is at hand."""

import os
from pathlib import Path

from odisar.config.simulators import VesselSimulatorConfig
from odisar.config.sources import PinnedFile
from odisar.report import overview
from odisar.report.figures.simulator import sea_trial
from odisar.report.gallery import Drawn
from odisar.report.page import SimulatorChecks
from odisar.report.style import save_figure
from odisar.simulators.vessel.plausibility import plausibility_table
from odisar.simulators.vessel.validation import sea_trial_table, validation_traces

_CAPTION = (
    "The simulator's equations with R/V Gunnerus' parameters beside a part of her sea trial; the "
    "state is set to the measured one between manoeuvres."
)


def check_simulator(
    config: VesselSimulatorConfig, seed: int, trial: Path | None, file: PinnedFile, folder: Path
) -> SimulatorChecks:
    """Return tables and figures; ``trial`` is the sea trial's CSV file, None if not there."""
    tables = [overview.plausibility(plausibility_table(config, seed))]
    if trial is None:
        advice = (
            "The equations can also be held against a public sea trial of R/V Gunnerus, which is "
            f"not part of this project. Set {file.environment_variable} to a copy of "
            f"{file.file_name} ({file.credit}) or run `make real`, which downloads it; then "
            "repeat the report stage."
        )
        return SimulatorChecks(tables, [], advice)
    tables.append(overview.sea_trial(sea_trial_table(trial)))
    path = folder / "sea-trial.png"
    save_figure(sea_trial(validation_traces(trial)), path)
    return SimulatorChecks(tables, [Drawn("recordings", "", _CAPTION, path)])


def find_trial(file: PinnedFile, root: Path) -> Path | None:
    """Return the sea trial's file if it is there already; nothing is downloaded."""
    named = os.environ.get(file.environment_variable, "").strip()
    path = Path(named).expanduser() if named else root / file.folder / file.file_name
    return path if path.is_file() else None
