"""The publish stage, with a tracker that only remembers."""

from types import SimpleNamespace

import pytest

from odisar.artifacts import read_json, write_json
from odisar.config.loader import ConfigView, load_config
from odisar.errors import OdisarError
from odisar.report.load import report_folder
from odisar.report.stamp import page_content
from odisar.stages import publish
from odisar.tracking import content_key
from odisar.tracking.story import UNTOLD

from .invented import ROOT
from .invented_tables import SETUPS


class RememberingTracker:
    def __init__(self):
        self.logged = {
            "params": {},
            "metrics": {},
            "artifacts": [],
            "tags": {},
            "notes": [],
            "datasets": [],
        }
        self.story = UNTOLD

    def parent(self):
        logged = self.logged
        return SimpleNamespace(
            params=logged["params"].update,
            metrics=lambda values, step=0: logged["metrics"].update(values) if not step else None,
            tags=logged["tags"].update,
            note=logged["notes"].append,
            dataset=lambda name, *_about: logged["datasets"].append(name),
            artifact=lambda path, _folder=None: logged["artifacts"].append(path.name),
        )

    def stage_seconds(self):
        return {"train": 125.0, "report": 20.04}


@pytest.fixture
def config():
    return ConfigView(load_config(ROOT), publish.PARAMS)


@pytest.fixture
def tracker():
    return RememberingTracker()


@pytest.fixture
def ready(workspace, monkeypatch):
    monkeypatch.setattr(publish, "register_bundles", lambda *_: None)  # see test_registry
    workspace.figures.mkdir(parents=True)
    write_json(workspace.metrics, {"vessel-all.odisar.s1.auroc": 0.95})
    (report_folder(workspace.root) / "body.html").write_text("<p>the body</p>")
    return workspace


def test_the_parent_run_gets_everything(config, ready, tracker):
    publish.run(config, ready, tracker)
    logged = tracker.logged
    assert logged["params"]["training"]["epochs"] == config.training.epochs
    assert logged["metrics"]["vessel-all.odisar.s1.auroc"] == 0.95
    assert logged["datasets"] == list(config.active_cases)
    assert "| set-up |" in logged["notes"][0]
    wanted = {f"{setup}.assessments.json" for setup in SETUPS} | {"report.html", "results"}
    assert wanted <= set(logged["artifacts"])
    assert list(logged["tags"].values()) == [content_key(ready.root)]


def test_the_page_is_made_of_the_body_and_of_what_tracking_knows(config, ready, tracker):
    publish.run(config, ready, tracker)
    page = ready.report.read_text()
    assert "<p>the body</p>" in page
    assert "2 min 5 s" in page
    assert "20.0 s" in page
    assert "from cache" in page
    assert page_content(ready.report) == content_key(ready.root)
    assert read_json(ready.root / "build/published.json") == {"content": content_key(ready.root)}


def test_a_second_time_logs_the_same(config, ready, tracker):
    publish.run(config, ready, tracker)
    before = dict(tracker.logged["params"])
    publish.run(config, ready, tracker)
    assert tracker.logged["params"] == before


def test_without_a_body_it_says_what_to_run(config, workspace, tracker):
    with pytest.raises(OdisarError, match="run the report stage"):
        publish.run(config, workspace, tracker)
