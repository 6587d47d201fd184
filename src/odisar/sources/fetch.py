"""Fetch pinned public files, or take the local copy that an environment variable names."""

import hashlib
import logging
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import BinaryIO

import pooch
from tqdm import tqdm

from odisar.config.sources import Pinned, PinnedFile, PinnedFolder
from odisar.errors import OdisarError

#: Takes one sentence for the user.
Say = Callable[[str], None]

# Names listed in an error; the rest is counted.
_NAMES_LISTED = 5


@dataclass(frozen=True)
class _Asset:
    """One file to download: its address, its sum, where it is kept, and what it is part of."""

    url: str
    sha256: str
    path: Path
    pinned: Pinned

    @property
    def way_out(self) -> str:
        what = "the files" if isinstance(self.pinned, PinnedFolder) else "the file"
        return f"set {self.pinned.environment_variable} to a local copy of {what}"


def fetch_pinned(file: PinnedFile, root: Path, say: Say = print) -> Path:
    """Return the path of ``file``, its SHA-256 checked, and tell the user its licence.

    Parameters
    ----------
    file
        The pinned file. A local copy named by its environment variable goes before a download.
    root
        The project's root; a download is kept in ``root / file.folder`` and not repeated.
    say
        Takes the sentence about licence and origin.

    Raises
    ------
    OdisarError
        The local copy cannot be read, the address cannot be reached, the file is larger than
        ``size_limit_mb``, or its SHA-256 differs from the pinned one.
    """
    local = _local_copy(file)
    path = _take_local(local, file) if local else root / file.folder / file.file_name
    if not local:
        _download(_Asset(file.url, file.sha256, path, file))
    say(f"{file.file_name}: {file.credit}; licence {file.licence}. It is not part of this project.")
    return path


def fetch_pinned_folder(folder: PinnedFolder, root: Path, say: Say = print) -> Path:
    """Return the folder that holds every file of the registry, each SHA-256 checked.

    Parameters
    ----------
    folder
        The pinned files. A local copy named by the environment variable goes before a download.
    root
        The project's root; downloads are kept in ``root / folder.folder``. Files that are there
        already, from a download that broke off as well, are not repeated.
    say
        Takes the sentences about progress, licence and origin.

    Raises
    ------
    OdisarError
        As ``fetch_pinned``; of a local copy, every file that is missing or differs is counted.
    """
    registry = read_registry(folder)
    local = _local_copy(folder)
    path = local or root / folder.folder
    if local:
        _check_local(local, folder, registry)
    else:
        assets = [
            _Asset(folder.url + name, sha256, path / name, folder)
            for name, sha256 in registry.items()
        ]
        _download_missing(assets, folder, say)
    say(
        f"{len(registry)} files: {folder.credit}; licence {folder.licence}. They are not part of "
        "this project."
    )
    return path


def read_registry(folder: PinnedFolder) -> dict[str, str]:
    """Return the SHA-256 of every published file, by its path below the address."""
    text = resources.files("odisar.sources").joinpath(folder.registry).read_text(encoding="utf-8")
    return dict(line.split() for line in text.splitlines())


def _local_copy(pinned: Pinned) -> Path | None:
    named = os.environ.get(pinned.environment_variable, "").strip()
    return Path(named).expanduser() if named else None


def _take_local(path: Path, file: PinnedFile) -> Path:
    variable = file.environment_variable
    if not path.is_file():
        raise OdisarError(
            f"{variable}={path}: there is no such file; set {variable} to a copy of {file.url} "
            "or unset it to download the file"
        )
    found = _sha256(path, variable)
    if found != file.sha256:
        raise OdisarError(
            f"{path}: expected SHA-256 {file.sha256}, found {found}; set {variable} to an "
            f"unchanged copy of {file.url} or unset it to download the file"
        )
    return path


def _check_local(path: Path, folder: PinnedFolder, registry: Mapping[str, str]) -> None:
    variable = folder.environment_variable
    if not path.is_dir():
        raise OdisarError(
            f"{variable}={path}: there is no such folder; set {variable} to a copy of {folder.url} "
            "or unset it to download the files"
        )
    missing = [name for name in registry if not (path / name).is_file()]
    changed = [
        name
        for name, sha256 in registry.items()
        if name not in missing and _sha256(path / name, variable) != sha256
    ]
    if missing or changed:
        problems = [
            f"{len(names)} of {len(registry)} files {problem} ({_listed(names)})"
            for names, problem in (
                (missing, "are missing"),
                (changed, "have another SHA-256 than the published ones"),
            )
            if names
        ]
        raise OdisarError(
            f"{variable}={path}: {' and '.join(problems)}; set {variable} to an unchanged copy of "
            f"{folder.url} or unset it to download the files"
        )


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _NAMES_LISTED
    return ", ".join(names[:_NAMES_LISTED]) + (f" and {more} more" if more > 0 else "")


def _sha256(path: Path, variable: str) -> str:
    try:
        with path.open("rb") as handle:
            return hashlib.file_digest(handle, "sha256").hexdigest()
    except OSError as error:
        raise OdisarError(
            f"{path}: cannot be read ({error.strerror}); set {variable} to a readable copy"
        ) from error


def _download_missing(assets: Sequence[_Asset], folder: PinnedFolder, say: Say) -> None:
    """Download what is not there yet; on a terminal a bar counts the files."""
    variable = folder.environment_variable
    wanted = [
        asset
        for asset in assets
        if not asset.path.is_file() or _sha256(asset.path, variable) != asset.sha256
    ]
    if not wanted:
        return
    say(f"downloading {len(wanted)} of {len(assets)} files from {folder.url} to {folder.folder}")
    bar = tqdm(wanted, unit="file", leave=False, disable=not sys.stderr.isatty())
    with _quiet_pooch():
        for asset in bar:
            _download(asset)


@contextmanager
def _quiet_pooch() -> Iterator[None]:
    """Keep pooch from writing two lines about each of many files."""
    logger = pooch.get_logger()
    level = logger.level
    logger.setLevel(logging.WARNING)
    try:
        yield
    finally:
        logger.setLevel(level)


def _download(asset: _Asset) -> None:
    try:
        pooch.retrieve(
            url=asset.url,
            known_hash=f"sha256:{asset.sha256}",
            fname=asset.path.name,
            path=asset.path.parent,
            downloader=_PinnedDownloader(asset),
        )
    except OSError as error:
        raise OdisarError(
            f"{asset.url}: cannot be downloaded to {asset.pinned.folder} ({type(error).__name__}); "
            f"check the connection, or {asset.way_out}"
        ) from error


class _PinnedDownloader:
    """A pooch downloader that stops at the size limit and names what it expected and found.

    pooch checks the hash as well, but only after the whole body, however long, is on disk.
    """

    def __init__(self, asset: _Asset) -> None:
        self._asset = asset

    def __call__(self, url: str, output_file: str, pooch_instance: object) -> None:
        """Write the body at ``url`` to ``output_file``."""
        pinned = self._asset.pinned
        with Path(output_file).open("wb") as handle:
            limited = _LimitedWriter(handle, self._asset)
            pooch.HTTPDownloader(timeout=pinned.timeout_s)(url, limited, pooch_instance)
        found = _sha256(Path(output_file), pinned.environment_variable)
        if found != self._asset.sha256:
            raise OdisarError(
                f"{self._asset.path.name} from {url}: expected SHA-256 {self._asset.sha256}, found "
                f"{found}; it was not kept: try again, or set {pinned.environment_variable} to a "
                "copy with the expected sum"
            )


class _LimitedWriter:
    """A file that refuses to grow beyond the size limit of a pinned file."""

    def __init__(self, handle: BinaryIO, asset: _Asset) -> None:
        self._handle = handle
        self._asset = asset
        self._written = 0

    def write(self, chunk: bytes) -> int:
        """Write ``chunk``; raise OdisarError where the limit would be passed."""
        self._written += len(chunk)
        limit_mb = self._asset.pinned.size_limit_mb
        if self._written > limit_mb * 1e6:
            raise OdisarError(
                f"{self._asset.url}: larger than size_limit_mb={limit_mb}, which the pinned file "
                f"is not; it was not kept: {self._asset.way_out}"
            )
        return self._handle.write(chunk)

    def flush(self) -> None:
        """Flush the file below."""
        self._handle.flush()
