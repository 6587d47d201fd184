"""Put a profile into ``params.yaml``; every other byte of the file stays as it is."""

import os
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from odisar.config.loader import PARAMS_FILE, Config, read_yaml
from odisar.errors import OdisarError
from odisar.workspaces import merge_profile


def check_name(root: Path, name: str, *, write: bool) -> None:
    """Raise OdisarError where a proposal of this name would change what is there."""
    params = read_yaml(root / PARAMS_FILE)
    another = "choose another name with --name"
    for section in ("cases", "setups"):
        if name in (params.get(section) or {}):
            raise OdisarError(f"{section}.{name} is declared in {PARAMS_FILE}: {another}")
    if write and name in (params.get("profiles") or {}):
        raise OdisarError(
            f"profiles.{name} is already in {PARAMS_FILE}: {another}, or remove that section to "
            "have it proposed anew"
        )


def checked_config(root: Path, name: str, text: str) -> Config:
    """Return the configuration that a profile's text makes, validated as a run would."""
    yaml = YAML()
    params: dict[str, Any] = yaml.load((root / PARAMS_FILE).read_text(encoding="utf-8"))
    params["profiles"][name] = yaml.load(StringIO(f"profiles:\n{text}"))["profiles"][name]
    return merge_profile(params, name)


def write_profile(root: Path, name: str, text: str) -> None:
    """Put a profile at the end of ``profiles``.

    Raises
    ------
    OdisarError
        If the file has no such block, or would say anything else than before.
    """
    path = root / PARAMS_FILE
    raw = path.read_bytes()
    before = raw.decode("utf-8")
    ending = "\r\n" if "\r\n" in before else "\n"
    lines = before.splitlines(keepends=True)
    at = _end_of_profiles(before, lines)
    if at and not lines[at - 1].endswith(("\n", "\r")):
        lines[at - 1] += ending
    after = "".join([*lines[:at], text.replace("\n", ending), *lines[at:]])
    _check_rest(before, after, name)
    new = path.with_name(f".{path.name}.new")
    new.write_bytes(after.encode("utf-8"))
    new.chmod(path.stat().st_mode)
    os.replace(new, path)  # noqa: PTH105 - one step: the file is never half written


def _end_of_profiles(text: str, lines: list[str]) -> int:
    """Return the number of lines up to the end of the block ``profiles``."""
    params = YAML().load(text)
    profiles = params.get("profiles")
    if not profiles or profiles.fa.flow_style():
        raise OdisarError(
            f"{PARAMS_FILE} has no block `profiles:` with a profile in it; copy what is printed "
            "below a line `profiles:`"
        )
    start = params.lc.key("profiles")[0]
    later = [params.lc.key(key)[0] for key in params if params.lc.key(key)[0] > start]
    end = min(later, default=len(lines))
    # Comments and blank lines before the next section belong to that.
    while later and end > start + 1 and not lines[end - 1].startswith("  "):
        end -= 1
    while not later and end > start + 1 and not lines[end - 1].strip():
        end -= 1
    return end


def _check_rest(before: str, after: str, name: str) -> None:
    old, new = (YAML(typ="safe", pure=True).load(text) for text in (before, after))
    added = new.get("profiles", {}).pop(name, None)
    if added is None or old != new:
        raise OdisarError(
            f"{PARAMS_FILE} is laid out in a way that can't be added to; copy what is printed "
            "to its profiles by hand"
        )
