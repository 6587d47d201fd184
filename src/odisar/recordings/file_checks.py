"""Whether a file can be opened at all and is not larger than a recording may be."""

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
        size = path.stat().st_size
    except OSError as fault:
        note_unreadable(fault, notes)
        return False
    return check_size(size, "file", notes)


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
