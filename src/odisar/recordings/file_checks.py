"""Whether a file can be opened at all and is not larger than a recording may be."""

import stat
from pathlib import Path

from odisar.recordings.quality import Notes

#: Larger files are refused: one recording this long does not fit in memory beside its windows.
MAX_FILE_BYTES = 512 * 1024 * 1024


def check_file(path: Path, notes: Notes) -> bool:
    """Return whether ``path`` is a file of an acceptable size; if not, ``notes`` say why."""
    if path.is_dir():
        notes.error("a folder has the name of a recording", "rename or remove the folder")
        return False
    try:
        found = path.stat()
    except OSError as fault:
        note_unreadable(fault, notes)
        return False
    if not stat.S_ISREG(found.st_mode):
        note_special(path, notes)
        return False
    return check_size(found.st_size, "file", notes)


def is_special(path: Path) -> bool:
    """Return whether a path leads to what is neither a file nor a folder: reading may not end."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return not stat.S_ISREG(mode) and not stat.S_ISDIR(mode)


def note_special(path: Path, notes: Notes) -> None:
    """Note that a pipe, a socket or a device has the name of a file to read."""
    notes.error(
        "not a regular file but a pipe, a socket or a device: it is not read",
        "replace it by a file, or remove it",
        value=path.name,
    )


def check_size(size: int, what: str, notes: Notes, row: int | None = None) -> bool:
    """Return whether so many bytes are within the limit."""
    if size <= MAX_FILE_BYTES:
        return True
    notes.error(
        f"the {what} is larger than the limit of {MAX_FILE_BYTES // 1024**2} MiB",
        "split it into several recordings",
        row=row,
        value=f"{size / 1024**2:.0f} MiB",
    )
    return False


def note_unreadable(fault: OSError, notes: Notes) -> None:
    """Note that the file cannot be read, with the system's reason."""
    notes.error(
        "the file cannot be read",
        "check that it exists and that you may read it",
        value=fault.strerror or type(fault).__name__,
    )
