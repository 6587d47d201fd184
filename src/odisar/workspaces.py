"""Lay a copy of the project out with a profile's parameters, to run the same pipeline there."""

import shutil
from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from odisar.config.loader import PARAMS_FILE, load_config, parse_config
from odisar.errors import OdisarError

_COPIED = ("dvc.yaml", ".dvcignore", "src", "notebooks")
_LEFT_OUT = shutil.ignore_patterns("__pycache__", "*.egg-info", ".ipynb_checkpoints")


def lay_out(root: Path, profile: str) -> Path:
    """Write ``workspaces/<profile>`` below ``root`` and return it.

    Code and pipeline are copied anew each time; recordings and artefacts that are there stay, so
    that a second run does only what changed. Raises OdisarError for an unknown profile.
    """
    config = load_config(root)
    if profile not in config.profiles:
        raise OdisarError(
            f"profile {profile!r} is not declared in {PARAMS_FILE}; declared are: "
            f"{', '.join(config.profiles)}"
        )
    target = root / "workspaces" / profile
    target.mkdir(parents=True, exist_ok=True)
    for name in _COPIED:
        _copy(root / name, target / name)
    yaml = YAML()
    yaml.width = 1000
    params = yaml.load((root / PARAMS_FILE).read_text(encoding="utf-8"))
    merge(params, config.profiles[profile], f"profiles.{profile}")
    parse_config(YAML(typ="safe", pure=True).load(_dump(yaml, params)), f"profile {profile!r}")
    (target / PARAMS_FILE).write_text(_dump(yaml, params), encoding="utf-8")
    return target


def merge(values: dict[str, Any], changes: Mapping[str, Any], origin: str) -> None:
    """Put ``changes`` over ``values``, in place, mapping by mapping; unknown keys are refused."""
    for key, change in changes.items():
        if key not in values:
            raise OdisarError(f"{origin}.{key}: there is no such parameter to change")
        if isinstance(change, Mapping) and isinstance(values[key], dict):
            merge(values[key], change, f"{origin}.{key}")
        else:
            values[key] = change


def _dump(yaml: YAML, params: Mapping[str, Any]) -> str:
    text = StringIO()
    yaml.dump(params, text)
    return text.getvalue()


def _copy(source: Path, target: Path) -> None:
    if not source.exists():
        raise OdisarError(f"{source} is missing; run this in the project's root")
    if source.is_dir():
        shutil.rmtree(target, ignore_errors=True)
        shutil.copytree(source, target, ignore=_LEFT_OUT)
    else:
        shutil.copyfile(source, target)
