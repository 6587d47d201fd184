"""What the MLflow UI says of a run, so that it can be read without the code."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from odisar.config.loader import Config, read_yaml
from odisar.errors import OdisarError

EXPERIMENT_NOTE = (
    "Each run at the top level is **one configuration through the whole pipeline**; unfold it for "
    "its stages, and *tune* for its trials. Its metrics are what the test recordings gave "
    "(`set-up.detector.strength.metric`) and, by epoch, how its twins learned; its artefacts hold "
    "the report, figures, thresholds and assessments. Tick several and choose *Compare*.\n\n"
    "Calibrated detectors are under *Model registry*, as `experiment.set-up`."
)


@dataclass(frozen=True)
class Story:
    """Name and description of a configuration's run, and those of its stages by name."""

    title: str
    note: str
    tags: Mapping[str, str]
    stages: Mapping[str, str]


#: For a run of which nothing is told.
UNTOLD = Story("pipeline", "", {}, {})


def tell_story(config: Config, root: Path) -> Story:
    """Return what is said of the workspace's configuration."""
    setups = config.pipeline.setups
    lines = [f"**{config.report.title}**", "", "| set-up | case | trained on |", "|---|---|---|"]
    for name in setups:
        select = config.setups[name].select
        kept = "; ".join(f"{key}: {', '.join(values)}" for key, values in select.items())
        lines.append(f"| {name} | {config.case_of(name).title} | {kept or 'all that is normal'} |")
    tags = {"setups": ", ".join(setups), "cases": ", ".join(config.active_cases)}
    return Story(" + ".join(setups), "\n".join(lines), tags, _stage_notes(root))


def results_note(story: Story, heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return the description of a finished run: what it is, and what came out."""
    table = [heads, ["---"] * len(heads), *rows]
    lines = ["**Results (P2, test recordings, 95 % intervals)**", ""]
    lines += [f"| {' | '.join(row)} |" for row in table]
    lines += ["", "The whole of it: artefact `report.html`."]
    return "\n".join([*lines, "", story.note])


def _stage_notes(root: Path) -> dict[str, str]:
    """Return what dvc.yaml says of each stage."""
    try:
        stages: dict[str, Any] = read_yaml(root / "dvc.yaml").get("stages", {})
    except OdisarError:  # a stage may be run by hand where there is no pipeline
        return {}
    return {name: str(stage.get("desc", "")) for name, stage in stages.items()}
