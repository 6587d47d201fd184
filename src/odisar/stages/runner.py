"""Run one stage: parameters checked whole, only the declared ones handed over, all tracked."""

import importlib
import os
from pathlib import Path

from odisar.artifacts import Workspace
from odisar.config.loader import ConfigView, load_config
from odisar.tracking import Tracker
from odisar.tracking.story import tell_story

#: In the order of ``dvc.yaml``.
STAGES = ("preprocess", "tune", "train", "calibrate", "evaluate", "bundle", "report", "publish")

# NumPy's threads would compete with the processes that share the cores.
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def run_stage(name: str, root: Path) -> None:
    """Run the stage ``name`` in the workspace ``root``."""
    for variable in _ONE_THREAD:
        os.environ.setdefault(variable, "1")
    config = load_config(root)
    stage = importlib.import_module(f"odisar.stages.{name}")
    view = ConfigView(config, stage.PARAMS)
    workspace = Workspace(root)
    tracker = Tracker(root, config.tracking.experiment, tell_story(config, root))
    with tracker.stage(name) as tracked:
        tracked.params({section: plain(getattr(config, section)) for section in stage.PARAMS})
        if name == STAGES[-1]:  # the last stage completes the parent run
            stage.run(view, workspace, tracker)
        else:
            stage.run(view, workspace, tracked)
    if name == STAGES[-1]:
        tracker.finish()


def plain(section: object) -> object:
    """Return a section of the configuration as plain mappings and values."""
    if isinstance(section, dict):
        return {key: plain(value) for key, value in section.items()}
    dump = getattr(section, "model_dump", None)
    return dump() if dump else section
