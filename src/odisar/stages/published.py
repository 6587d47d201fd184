"""Whether page and parent run are of what is in the workspace now."""

from pathlib import Path

from odisar.artifacts import Workspace
from odisar.config.loader import load_config
from odisar.report.stamp import page_content
from odisar.stages.runner import run_stage
from odisar.tracking import FINISHED, PUBLISHED_TAG, Tracker, content_key


def ensure_published(root: Path) -> None:
    """Publish again where DVC had no reason to, but page or parent run are not of this content.

    DVC restores a stage that it has run before from its cache; the page, which is none of its
    outputs, is then still that of the run in between.
    """
    config = load_config(root)
    found = Tracker(root, config.tracking.experiment).find_parent()
    key = content_key(root)
    is_complete = (
        found is not None
        and found.data.tags.get(PUBLISHED_TAG) == key
        and found.info.status == FINISHED
    )
    if not is_complete or page_content(Workspace(root).report) != key:
        run_stage("publish", root)
