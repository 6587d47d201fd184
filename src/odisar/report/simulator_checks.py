"""The sea trial in the report, where its file is at hand.

The file is no part of the project, so what it shows must not reach an output of the pipeline: with
it and without it, the pipeline makes the same bytes.
"""

import os
from pathlib import Path

from odisar.config.sources import PinnedFile
from odisar.report import overview
from odisar.report.figures.simulator import sea_trial
from odisar.report.gallery import Drawn
from odisar.report.page import SeaTrial
from odisar.report.style import save_figure
from odisar.simulators.vessel.validation import sea_trial_table, validation_traces

_CAPTION = (
    "The simulator's equations with R/V Gunnerus' parameters beside a part of her sea trial; the "
    "state is set to the measured one between manoeuvres."
)


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
    save_figure(sea_trial(validation_traces(trial)), figure)
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
