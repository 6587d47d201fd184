from pathlib import Path

import pytest

from odisar.artifacts import Workspace
from odisar.config.loader import ConfigView, load_config
from odisar.report.load import SECTIONS, Results

from .invented import ROOT, write_artefacts, write_examples, write_results


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    workspace = Workspace(tmp_path)
    write_results(workspace)
    write_artefacts(workspace)
    write_examples(workspace)
    return workspace


@pytest.fixture
def results(workspace: Workspace) -> Results:
    config = load_config(ROOT)
    pipeline = config.pipeline.model_copy(update={"setups": ["vessel-all", "vessel-random"]})
    shown = config.model_copy(update={"pipeline": pipeline})
    return Results(workspace, ConfigView(shown, SECTIONS))
