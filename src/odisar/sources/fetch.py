"""Fetch a pinned public file, or take the local copy that an environment variable names."""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import pooch

from odisar.config.sources import PinnedFile
from odisar.errors import OdisarError

#: Takes one sentence for the user.
Say = Callable[[str], None]


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
    local = os.environ.get(file.environment_variable, "").strip()
    path = _take_local(Path(local).expanduser(), file) if local else _download(file, root)
    say(f"{file.file_name}: {file.credit}; licence {file.licence}. It is not part of this project.")
    return path


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


def _sha256(path: Path, variable: str) -> str:
    try:
        with path.open("rb") as handle:
            return hashlib.file_digest(handle, "sha256").hexdigest()
    except OSError as error:
        raise OdisarError(
            f"{path}: cannot be read ({error.strerror}); set {variable} to a readable copy"
        ) from error


def _download(file: PinnedFile, root: Path) -> Path:
    try:
        fetched = pooch.retrieve(
            url=file.url,
            known_hash=f"sha256:{file.sha256}",
            fname=file.file_name,
            path=root / file.folder,
            downloader=_PinnedDownloader(file),
        )
    except OSError as error:
        raise OdisarError(
            f"{file.url}: cannot be downloaded to {file.folder} ({type(error).__name__}); check "
            f"the connection, or set {file.environment_variable} to a local copy of the file"
        ) from error
    return Path(fetched)


class _PinnedDownloader:
    """A pooch downloader that stops at the size limit and names what it expected and found.

    pooch checks the hash as well, but only after the whole body, however long, is on disk.
    """

    def __init__(self, file: PinnedFile) -> None:
        self._file = file

    def __call__(self, url: str, output_file: str, pooch_instance: object) -> None:
        """Write the body at ``url`` to ``output_file``."""
        with Path(output_file).open("wb") as handle:
            limited = _LimitedWriter(handle, self._file)
            pooch.HTTPDownloader(timeout=self._file.timeout_s)(url, limited, pooch_instance)
        found = _sha256(Path(output_file), self._file.environment_variable)
        if found != self._file.sha256:
            raise OdisarError(
                f"{self._file.file_name} from {url}: expected SHA-256 {self._file.sha256}, found "
                f"{found}; nothing was kept: try again, or set "
                f"{self._file.environment_variable} to a copy with the expected sum"
            )


class _LimitedWriter:
    """A file that refuses to grow beyond the size limit of a pinned file."""

    def __init__(self, handle: BinaryIO, file: PinnedFile) -> None:
        self._handle = handle
        self._file = file
        self._written = 0

    def write(self, chunk: bytes) -> int:
        """Write ``chunk``; raise OdisarError where the limit would be passed."""
        self._written += len(chunk)
        if self._written > self._file.size_limit_mb * 1e6:
            raise OdisarError(
                f"{self._file.url}: larger than size_limit_mb={self._file.size_limit_mb}, which "
                "the pinned file is not; nothing was kept: set "
                f"{self._file.environment_variable} to a local copy of the file"
            )
        return self._handle.write(chunk)

    def flush(self) -> None:
        """Flush the file below."""
        self._handle.flush()
