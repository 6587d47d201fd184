"""Lay a copy of the project out with a profile's parameters, to run the same pipeline there.

A profile may bring a case of its own, with recordings anywhere on this machine: they are copied
into the workspace, whose pipeline tracks them; the project's own results stay as they are.
"""

import shutil
from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from odisar.config.loader import PARAMS_FILE, Config, load_config, parse_config
from odisar.errors import OdisarError

_COPIED = ("dvc.yaml", ".dvcignore", "src", "notebooks")
_OPEN_SECTIONS = ("cases", "setups")
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
    merged = merge_profile(params, profile)
    _bring_recordings(root, target, params, merged)
    (target / PARAMS_FILE).write_text(_dump(yaml, params), encoding="utf-8")
    return target


def merge_profile(params: dict[str, Any], profile: str) -> Config:
    """Put a profile's changes over ``params``, in place, and return what they make, validated."""
    changes = params["profiles"][profile]
    for section in _OPEN_SECTIONS:  # a profile may add cases and set-ups of its own
        added = changes.get(section, {})
        if not isinstance(added, Mapping):
            raise OdisarError(f"profiles.{profile}.{section}: expected names with their sections")
        for name in added:
            params[section].setdefault(name, added[name])
    merge(params, changes, f"profiles.{profile}")
    plain = YAML(typ="safe", pure=True).load(_dump(YAML(), params))
    return parse_config(plain, f"{PARAMS_FILE}, profile {profile!r}")


def _bring_recordings(root: Path, target: Path, params: dict[str, Any], config: Config) -> None:
    """Copy recordings that nothing can make into the workspace's ``data``, and point to them."""
    for name in config.active_cases:
        source = config.cases[name].source
        if source.maker != "none":
            continue
        origin = (root / Path(source.folder).expanduser()).resolve()
        if not origin.is_dir():
            raise OdisarError(
                f"cases.{name}.source.folder={source.folder}: there is no such folder; "
                "say where the recordings lie"
            )
        _mirror(origin, target / "data" / name)
        params["cases"][name]["source"]["folder"] = f"data/{name}"


def _mirror(origin: Path, target: Path) -> None:
    """Make ``target`` a copy of ``origin``; files that have not changed are left alone."""
    wanted = {path.relative_to(origin) for path in origin.rglob("*") if path.is_file()}
    for path in [path for path in target.rglob("*") if not path.is_dir()]:
        if path.relative_to(target) not in wanted:
            path.unlink()
    for name in sorted(wanted):
        copy = target / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        if not copy.exists() or _stamp(copy) != _stamp(origin / name):
            shutil.copy2(origin / name, copy)
    for folder in sorted((path for path in target.rglob("*") if path.is_dir()), reverse=True):
        if not any(folder.iterdir()):
            folder.rmdir()


def _stamp(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_size, status.st_mtime_ns


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
