"""Put the one-file report together and complete the parent run in MLflow.

The report says when and how long, so it differs from run to run and is no output of the pipeline;
what it is made from is.
"""

from datetime import datetime
from functools import partial
from typing import Any

from odisar.artifacts import Workspace, read_json, read_table, write_json
from odisar.config.loader import ConfigView
from odisar.deployment.development import DevelopmentScore
from odisar.errors import OdisarError
from odisar.report.headline import headline_table
from odisar.report.load import report_folder, rows_of
from odisar.report.page import RunFacts, render_page
from odisar.report.simulator_checks import show_sea_trial
from odisar.stages.bundle import measure_again
from odisar.stages.runner import STAGES, plain_sections
from odisar.tracking import (
    PUBLISHED_TAG,
    TrackedRun,
    Tracker,
    content_key,
    data_hash,
    flatten,
    git_revision,
)
from odisar.tracking.registry import register
from odisar.tracking.story import results_note

PARAMS = (
    "seed",
    "pipeline",
    "setups",
    "cases",
    "twin",
    "monte_carlo",
    "training",
    "tuning",
    "capability",
    "evaluation",
    "tracking",
    "registry",
    "report",
    "simulators",
    "sources",
)


def run(config: ConfigView, workspace: Workspace, tracker: Tracker) -> None:
    """Run the stage; a second time it changes nothing but the report's time."""
    sections = configured(config)
    write_report(config, workspace, tracker)
    parent = tracker.parent()
    parent.params(sections)
    parent.metrics(read_json(workspace.metrics))
    for epoch, values in learning_curves(workspace).items():
        parent.metrics(values, step=epoch)
    for name, profile in recordings_used(config, workspace).items():
        folder = config.cases[name].source.folder
        parent.dataset(name, data_hash(workspace.root), folder, profile)
    table = headline_table(read_table(workspace.results / "detection.csv"))
    parent.note(results_note(tracker.story, list(table.columns), table.to_numpy().tolist()))
    for setup in config.pipeline.setups:
        parent.artifact(workspace.thresholds(setup), "thresholds")
        parent.artifact(workspace.assessments(setup), "assessments")
    parent.artifact(workspace.results, "results")
    parent.artifact(workspace.figures, "figures")
    parent.artifact(workspace.report)
    register_bundles(config, workspace, parent)
    _mark(parent, workspace)


def learning_curves(workspace: Workspace) -> dict[int, dict[str, float]]:
    """Return, by epoch, the losses of every member that trained so long."""
    curves: dict[int, dict[str, float]] = {}
    for member, summary in read_json(workspace.train / "training.json").items():
        for row in summary["history"]:
            named = {f"{member}.{name}": value for name, value in row.items() if name != "epoch"}
            curves.setdefault(int(row["epoch"]), {}).update(named)
    return curves


def recordings_used(config: ConfigView, workspace: Workspace) -> dict[str, dict[str, Any]]:
    """Return, by case, recordings and hours of every split of each of its set-ups."""
    splits = read_table(workspace.preprocess / "splits.csv")
    used: dict[str, dict[str, Any]] = {name: {} for name in config.active_cases}
    counted = ["recordings", "hours"]
    totals = splits.groupby(["setup", "split"], sort=False, as_index=False)[counted].sum()
    for row in rows_of(totals):
        profile = used[config.setups[row.setup].case].setdefault(row.setup, {})
        profile[row.split] = f"{row.recordings:.0f} recordings, {row.hours:.1f} h"
    return used


def register_bundles(config: ConfigView, workspace: Workspace, parent: TrackedRun) -> None:
    """Register every set-up's bundle, once for this content, and print what came out."""
    scores = read_json(workspace.development)
    for setup in config.pipeline.setups:
        registration = register(
            workspace.root,
            parent,
            workspace.bundle(setup),
            DevelopmentScore(**scores[setup]),
            config.registry.champion,
            partial(measure_again, config, workspace, setup),
        )
        print(registration.line)  # noqa: T201


def write_report(config: ConfigView, workspace: Workspace, tracker: Tracker) -> None:
    """Write ``reports/report.html`` from the report stage's body and what tracking knows."""
    path = report_folder(workspace.root) / "body.html"
    if not path.is_file():
        raise OdisarError(f"{path} is missing; run the report stage (dvc repro)")
    facts = run_facts(config, workspace, tracker)
    body = path.read_text(encoding="utf-8")
    trial = None
    if "vessel" in config.active_simulators:
        picture = workspace.root / "build/sea-trial.png"
        trial = show_sea_trial(config.sources.gunnerus.file, workspace.root, picture)
    page = render_page(config.report.title, body, facts, flatten(configured(config)), trial)
    workspace.report.parent.mkdir(parents=True, exist_ok=True)
    workspace.report.write_text(page, encoding="utf-8")


def run_facts(config: ConfigView, workspace: Workspace, tracker: Tracker) -> RunFacts:
    """Return what tracking knows about the content of the workspace."""
    seconds = tracker.stage_seconds()
    return RunFacts(
        content=content_key(workspace.root),
        revision=git_revision(workspace.root),
        data=data_hash(workspace.root),
        experiment=config.tracking.experiment,
        published_at=datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z"),
        stages=[(name, _duration(seconds.get(name))) for name in STAGES if name != "publish"],
    )


def configured(config: ConfigView) -> dict[str, Any]:
    """Return every section as plain mappings, of set-ups and cases those that are run."""
    return plain_sections(config, PARAMS)


def _duration(seconds: float | None) -> str:
    if seconds is None:
        return "from cache"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{seconds:.1f} s"


def _mark(parent: TrackedRun, workspace: Workspace) -> None:
    key = content_key(workspace.root)
    write_json(workspace.root / "build/published.json", {"content": key})
    parent.tags({PUBLISHED_TAG: key})
