"""Run one stage: parameters checked whole, only the declared ones handed over, all tracked."""

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from odisar.artifacts import Workspace
from odisar.config.loader import ConfigView, load_config
from odisar.stages.parallel import prepare_jobs
from odisar.tracking import Tracker
from odisar.tracking.story import tell_story

#: In the order of ``dvc.yaml``.
STAGES = ("preprocess", "tune", "train", "calibrate", "evaluate", "bundle", "report", "publish")
#: Those that run their members side by side.
_OF_MEMBERS = ("tune", "train", "calibrate", "evaluate", "bundle")


def run_stage(name: str, root: Path) -> None:
    """Run the stage ``name`` in the workspace ``root``."""
    config = load_config(root)
    module = f"odisar.stages.{name}"
    if name in _OF_MEMBERS:
        prepare_jobs(module, config.pipeline.workers)
    stage = importlib.import_module(module)
    view = ConfigView(config, stage.PARAMS)
    workspace = Workspace(root)
    tracker = Tracker(root, config.tracking.experiment, tell_story(config, root))
    with tracker.stage(name) as tracked:
        tracked.params(plain_sections(config, stage.PARAMS))
        if name == STAGES[-1]:  # the last stage completes the parent run
            stage.run(view, workspace, tracker)
        else:
            stage.run(view, workspace, tracked)
    if name == STAGES[-1]:
        tracker.finish()


def plain_sections(config: Any, names: Sequence[str]) -> dict[str, Any]:
    """Return sections as plain mappings, without set-ups and cases that are not run."""
    sections: dict[str, Any] = {name: plain(getattr(config, name)) for name in names}
    kept = {"setups": config.pipeline.setups, "cases": config.active_cases}
    for name in kept.keys() & sections.keys():
        sections[name] = {k: v for k, v in sections[name].items() if k in kept[name]}
    return sections


def plain(section: object) -> object:
    """Return a section of the configuration as plain mappings and values."""
    if isinstance(section, dict):
        return {key: plain(value) for key, value in section.items()}
    dump = getattr(section, "model_dump", None)
    return dump() if dump else section
