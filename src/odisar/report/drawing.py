"""Draw every figure of the report that applies."""

from pathlib import Path

from odisar.report.exhibits import Drawn
from odisar.report.figures.learning import tuning_trials
from odisar.report.gallery import PLATES
from odisar.report.load import Results
from odisar.report.style import save_figure


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
    caption = "Every tuning trial's validation loss; no disturbed recording is looked at."
    if any(len(results.tuning(setup)) > 1 for setup in results.setups):
        caption += " Each fold has a study of its own; their trials stand side by side."
    drawn.append(Drawn("learning", "", caption, path))
    return drawn
