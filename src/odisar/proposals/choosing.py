"""Which case a folder is inspected as: the one named, one that declares it, or a proposal."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from odisar.config.cases import Case
from odisar.config.loader import PARAMS_FILE, Config, load_config
from odisar.errors import OdisarError
from odisar.proposals.new_case import propose
from odisar.recordings.reader import ReadResult, read_case
from odisar.workspaces import merge_profile


@dataclass(frozen=True)
class Chosen:
    """A case with the recordings read as it says; ``origin`` says where it is declared."""

    case: Case
    result: ReadResult
    origin: str


def choose_case(
    root: Path,
    folder: Path,
    profile: str | None,
    case_name: str | None,
    say: Callable[[str], None],
) -> Chosen:
    """Read a folder's recordings as the case says that fits; raise OdisarError where none does."""
    config = load_config(root)
    if case_name is not None:
        if case_name not in config.cases:
            raise OdisarError(
                f"case {case_name!r} is not declared in {PARAMS_FILE}; declared are: "
                f"{', '.join(config.cases)}"
            )
        return _read(root, folder, case_name, config.cases[case_name], f"case {case_name}")
    if profile is not None:
        return _of_profile(root, folder, config, profile)
    found = _declared(root, folder, config)
    if found is not None:
        return _read(root, folder, *found)
    proposal = propose(root, folder, None, say, write=False)
    origin = "`odisar new-case` would propose (no case in params.yaml has this folder)"
    return Chosen(proposal.case, proposal.result, origin)


def _read(root: Path, folder: Path, name: str, case: Case, origin: str) -> Chosen:
    shown = folder.resolve()
    path = shown.relative_to(root) if shown.is_relative_to(root) else shown
    source = case.source.model_copy(update={"folder": path.as_posix()})
    moved = case.model_copy(update={"source": source})
    return Chosen(moved, read_case(name, moved, root), origin)


def _of_profile(root: Path, folder: Path, config: Config, profile: str) -> Chosen:
    if profile not in config.profiles:
        raise OdisarError(
            f"profile {profile!r} is not declared in {PARAMS_FILE}; declared are: "
            f"{', '.join(config.profiles)}"
        )
    merged = _merged(root, profile)
    active = merged.active_cases
    own = [name for name in active if name in (config.profiles[profile].get("cases") or {})]
    fitting = [name for name in active if _has_folder(root, merged.cases[name], folder)]
    names = fitting or own or active
    if len(names) > 1:
        raise OdisarError(
            f"profile {profile!r} runs the cases {', '.join(names)}; give the folder of one"
        )
    return _read(root, folder, names[0], merged.cases[names[0]], f"profile {profile} says")


def _declared(root: Path, folder: Path, config: Config) -> tuple[str, Case, str] | None:
    """Return a case, of the file itself or of a profile, whose folder this is."""
    for name, case in config.cases.items():
        if _has_folder(root, case, folder):
            return name, case, f"case {name} says"
    for profile, changes in config.profiles.items():
        for name, section in _own_cases(changes).items():
            source = section.get("source") if isinstance(section, dict) else None
            declared = source.get("folder") if isinstance(source, dict) else None
            if isinstance(declared, str) and _is_same(root, declared, folder):
                return name, _merged(root, profile).cases[name], f"profile {profile} says"
    return None


def _own_cases(changes: dict[str, Any]) -> dict[str, Any]:
    cases = changes.get("cases")
    return cases if isinstance(cases, dict) else {}


def _merged(root: Path, profile: str) -> Config:
    params: dict[str, Any] = YAML().load((root / PARAMS_FILE).read_text(encoding="utf-8"))
    return merge_profile(deepcopy(params), profile)


def _has_folder(root: Path, case: Case, folder: Path) -> bool:
    return _is_same(root, case.source.folder, folder)


def _is_same(root: Path, declared: str, folder: Path) -> bool:
    return (root / Path(declared).expanduser()).resolve() == folder.resolve()
