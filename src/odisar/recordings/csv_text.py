"""A CSV file's text: what it holds, whatever it is encoded in, or why it cannot be read."""

import codecs
from pathlib import Path

from odisar.recordings.file_checks import check_file, note_unreadable
from odisar.recordings.quality import Notes

_UTF8 = "save the file as CSV in UTF-8"


def read_text(path: Path, notes: Notes) -> str | None:
    """Return the file's text without its byte order mark, or None with the reason in ``notes``.

    A file in another encoding is an error, and its text is still returned, so that its other
    faults are found in the same pass.
    """
    raw = _read_bytes(path, notes)
    if raw is None:
        return None
    if not raw.strip(codecs.BOM_UTF8 + b" \t\r\n"):
        notes.error("the file is empty", "export it again, or remove it")
        return None
    if raw.startswith((codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)):  # LE starts as UTF-16 does
        notes.error("the file is in UTF-32", _UTF8, row=1)
        return raw.decode("utf-32", errors="replace")
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        notes.error("the file is in UTF-16", _UTF8, row=1)
        return raw.decode("utf-16", errors="replace")
    if b"\0" in raw:
        row = raw.count(b"\n", 0, raw.index(b"\0")) + 1
        notes.error("the file is binary, not text", "export it as CSV, or remove it", row=row)
        return None
    return _decode(raw, notes)


def _decode(raw: bytes, notes: Notes) -> str | None:
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        row = raw.count(b"\n", 0, fault.start) + 1
        value = f"byte 0x{raw[fault.start]:02x}"
    if _looks_binary(raw):
        notes.error("the file is binary, not text", "export it as CSV, or remove it", row=row)
        return None
    notes.error("the file is not in UTF-8", _UTF8, row=row, value=value)
    return raw.decode("cp1252", errors="replace")


def _looks_binary(raw: bytes) -> bool:
    sample = raw[:4096]
    controls = sum(byte < 32 and byte not in b"\t\r\n" for byte in sample)
    return controls > len(sample) // 50


def _read_bytes(path: Path, notes: Notes) -> bytes | None:
    if not check_file(path, notes):
        return None
    try:
        return path.read_bytes()
    except OSError as fault:
        note_unreadable(fault, notes)
        return None
