"""A project of its own for commands on a stranger's recordings, and the folder of these."""

import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent


@pytest.fixture
def root(tmp_path, monkeypatch):
    """A project that a command can run in and that a profile can be laid out from."""
    project = tmp_path / "project"
    project.mkdir()
    for name in ("params.yaml", "dvc.yaml", ".dvcignore"):
        shutil.copyfile(ROOT / name, project / name)
    for name in ("src", "notebooks"):
        (project / name).mkdir()
    monkeypatch.chdir(project)
    return project


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "Prüffahrten 2024"
    path.mkdir()
    return path
