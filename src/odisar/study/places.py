"""Where the study keeps what it has finished: a killed study goes on from there."""

import hashlib
import json
from pathlib import Path

from odisar.artifacts import Workspace
from odisar.config.loader import PARAMS_FILE, read_yaml

#: Code that decides what is trained and scored; with another state of it that is done anew.
_DECISIVE = (
    "baselines",
    "capability",
    "config",
    "evaluation",
    "fitting.py",
    "forecasters",
    "recordings",
    "stages",
    "study",
    "twin",
    "windows",
)


def study_folder(workspace: Workspace) -> Path:
    """Return the folder of what was finished with these parameters, recordings and this code."""
    digest = hashlib.sha256()
    params = read_yaml(workspace.root / PARAMS_FILE)
    params.pop("profiles", None)
    digest.update(json.dumps(params, default=str).encode())
    source = Path(__file__).parent.parent
    files = [path for name in _DECISIVE for path in _code(source / name)]
    for path in [workspace.root / "data.dvc", *files]:
        if path.exists():
            digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return workspace.study / digest.hexdigest()[:12]


def _code(path: Path) -> list[Path]:
    """Return a module itself, or the modules of a package in a fixed order."""
    return sorted(path.rglob("*.py")) if path.is_dir() else [path]


def alternatives_folder(workspace: Workspace, setup: str) -> Path:
    """Return the folder of what the study's alternatives said of a set-up's recordings."""
    return study_folder(workspace) / "alternatives" / setup
