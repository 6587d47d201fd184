"""The manifest of a bundle: what it is, and size and SHA-256 of every file in it."""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError

from odisar import __version__
from odisar.config.base import Section
from odisar.errors import OdisarError

MANIFEST_FILE = "manifest.json"
#: Rises when a bundle written now can't be read by an older odisar, or the other way round.
#: 2: the score takes the closed form in, so that thresholds of before would mean something else.
#: 3: it takes the consistency of one sample in.
#: 4: it takes the noise of one sensor and the scatter over many samples in.
#: 5: it lets go of something strong that is over.
#: 6: it seeks the shift of one state.
#: 7: it holds statistics to the newer half of their windows.
#: 8: it holds the noise of one sensor to it as well; margins may lie below zero.
SCHEMA_VERSION = 8
#: No manifest is longer, no other JSON, and no file of a bundle at all: bytes.
MANIFEST_LIMIT = 1_000_000
CONTENT_LIMIT = 16_000_000
FILE_LIMIT = 512 * 1024 * 1024

_WAY_OUT = "take the bundle from its registry again, or run the bundle stage (dvc repro)"


class FileEntry(Section):
    """One file of a bundle."""

    bytes: Annotated[int, Field(ge=0, le=FILE_LIMIT)]
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class Origin(Section):
    """What a bundle was made from.

    ``member`` is the twin, one of ``members`` of the set-up; a cross-fitted set-up has one a fold.
    ``content`` names the exact inputs. There is no time stamp: equal inputs give equal bytes.
    """

    setup: str
    case: str
    member: str
    members: Annotated[int, Field(gt=0)]
    content: str


class Manifest(Section):
    """Everything but the files themselves."""

    schema_version: int
    odisar: str
    origin: Origin
    files: dict[Annotated[str, Field(pattern=r"^[A-Za-z0-9._-]+$")], FileEntry]


def write_manifest(folder: Path, origin: Origin) -> None:
    """Write the manifest of the files that lie in a folder now."""
    files = {path.name: _entry(path) for path in sorted(folder.iterdir())}
    manifest = Manifest(
        schema_version=SCHEMA_VERSION, odisar=__version__, origin=origin, files=files
    )
    write_json_object(folder / MANIFEST_FILE, manifest.model_dump())


def read_manifest(folder: Path) -> Manifest:
    """Read a manifest and hold every file of the folder against it.

    Raises
    ------
    OdisarError
        If the manifest is missing, malformed or of another schema version, or a file is missing,
        surplus, of another size or of another SHA-256.
    """
    if not folder.is_dir():
        raise OdisarError(f"{folder} is no folder, so no bundle; {_WAY_OUT}")
    path = folder / MANIFEST_FILE
    content = read_json_object(path, MANIFEST_LIMIT)
    _check_version(path, content)
    try:
        manifest = Manifest.model_validate(content)
    except ValidationError as error:
        raise OdisarError(f"{path}: {first_problem(error)}; {_WAY_OUT}") from error
    _check_listing(folder, list(manifest.files))
    for name, entry in manifest.files.items():
        _check_file(folder / name, entry)
    return manifest


def manifest_hash(folder: Path) -> str:
    """Return the SHA-256 of a bundle's manifest, which stands for the whole bundle."""
    return _hash_file(folder / MANIFEST_FILE)


def read_json_object(path: Path, limit: int = CONTENT_LIMIT) -> dict[str, Any]:
    """Read a JSON object from a plain file of at most ``limit`` bytes.

    Raises OdisarError where there is none; NaN and infinity are no JSON.
    """
    if path.is_symlink() or not path.is_file():
        raise OdisarError(f"{path} is missing (or no plain file); {_WAY_OUT}")
    size = path.stat().st_size
    if size > limit:
        raise OdisarError(f"{path} has {size} bytes, more than the {limit} allowed; {_WAY_OUT}")
    try:
        content = json.loads(path.read_text(encoding="utf-8"), parse_constant=_refuse_constant)
    except (OSError, ValueError, RecursionError) as error:
        raise OdisarError(f"{path}: not valid JSON ({error}); {_WAY_OUT}") from error
    if not isinstance(content, dict):
        raise OdisarError(f"{path}: expected a JSON object; {_WAY_OUT}")
    return content


def write_json_object(path: Path, content: dict[str, Any]) -> None:
    """Write JSON whose bytes depend on the content alone; the order of its keys is kept."""
    text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def first_problem(error: ValidationError) -> str:
    """Return the first complaint of a validation as one sentence that names the key."""
    problem = error.errors(include_url=False)[0]
    key = ".".join(str(part) for part in problem["loc"]) or "(whole file)"
    return f"{key}: {problem['msg'].removeprefix('Value error, ')}"


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is no JSON number")


def _check_version(path: Path, content: dict[str, Any]) -> None:
    version = content.get("schema_version")
    if version == SCHEMA_VERSION and not isinstance(version, bool):
        return
    if isinstance(version, int) and not isinstance(version, bool) and version > SCHEMA_VERSION:
        raise OdisarError(
            f"{path}: schema_version={version} is newer than the {SCHEMA_VERSION} that odisar "
            f"{__version__} reads; use odisar {str(content.get('odisar', 'as new'))[:40]} or newer"
        )
    raise OdisarError(
        f"{path}: schema_version={str(version)[:40]!r} is not known; odisar {__version__} reads "
        f"{SCHEMA_VERSION}; write the bundle again with this odisar"
    )


def _check_listing(folder: Path, listed: Sequence[str]) -> None:
    found = {path.name for path in folder.iterdir()} - {MANIFEST_FILE}
    for name in sorted(found - set(listed)):
        raise OdisarError(
            f"{folder / name} is not listed in {MANIFEST_FILE}; {_WAY_OUT}, or remove the file"
        )
    for name in sorted(set(listed) - found):
        raise OdisarError(
            f"{folder / name} is missing, though {MANIFEST_FILE} lists it; {_WAY_OUT}"
        )


def _check_file(path: Path, entry: FileEntry) -> None:
    if path.is_symlink() or not path.is_file():
        raise OdisarError(f"{path} is no plain file; {_WAY_OUT}")
    size = path.stat().st_size
    if size != entry.bytes:
        raise OdisarError(
            f"{path} has {size} bytes, not the {entry.bytes} of {MANIFEST_FILE}; {_WAY_OUT}"
        )
    if _hash_file(path) != entry.sha256:
        raise OdisarError(
            f"{path} has been changed: its SHA-256 is not that of {MANIFEST_FILE}; {_WAY_OUT}"
        )


def _entry(path: Path) -> FileEntry:
    return FileEntry(bytes=path.stat().st_size, sha256=_hash_file(path))


def _hash_file(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
