"""What the checks of a folder of recordings found, as findings, as an error and as a report."""

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

import pandas as pd

from odisar.errors import OdisarError
from odisar.recordings.schema import Recording

Severity = Literal["error", "warning"]

#: Rows listed for one problem of one column; the rest of them are counted, not listed.
ROWS_LISTED = 5

_VALUE_WIDTH = 32

#: Columns of the quality table, one row a file.
QUALITY_COLUMNS = (
    "file",
    "samples",
    "seconds",
    "segments",
    "gaps",
    "errors",
    "warnings",
    "findings",
)


@dataclass(frozen=True)
class Finding:
    """One thing found wrong (``error``) or worth knowing (``warning``).

    ``row`` is the line number in a CSV file (header included, as an editor shows it), the row
    number in a Parquet file or the message number in a bag; ``column``, ``row`` and ``value``
    are empty where the finding is about the whole file or folder.
    """

    severity: Severity
    file: str
    column: str
    row: int | None
    value: str
    problem: str
    remedy: str


class Notes:
    """Collects the findings of one file, at most ``ROWS_LISTED`` of a kind; the rest are counted.

    Findings are of a kind if severity, column and problem are the same.
    """

    def __init__(self, file: str) -> None:
        self.file = file
        self._listed: dict[tuple[Severity, str, str], list[Finding]] = {}
        self._rest: Counter[tuple[Severity, str, str]] = Counter()

    @property
    def findings(self) -> list[Finding]:
        """Everything found so far, kind by kind, each with the count of what is not listed."""
        findings: list[Finding] = []
        for kind, listed in self._listed.items():
            findings += listed
            if self._rest[kind]:
                more = f"and {self._rest[kind]} more"
                findings.append(replace(listed[-1], row=None, value=more))
        return findings

    @property
    def has_errors(self) -> bool:
        """Whether anything found so far keeps the file from being used."""
        return any(severity == "error" for severity, _, _ in self._listed)

    def error(
        self,
        problem: str,
        remedy: str,
        *,
        column: str = "",
        row: int | None = None,
        value: object = "",
    ) -> None:
        """Note one error."""
        self._add(Finding("error", self.file, column, row, str(value), problem, remedy))

    def warning(
        self,
        problem: str,
        remedy: str,
        *,
        column: str = "",
        row: int | None = None,
        value: object = "",
    ) -> None:
        """Note one warning."""
        self._add(Finding("warning", self.file, column, row, str(value), problem, remedy))

    def rows(
        self,
        problem: str,
        remedy: str,
        cells: Sequence[tuple[int, str]],
        *,
        total: int,
        column: str = "",
        severity: Severity = "error",
    ) -> None:
        """Note one problem met in ``total`` rows, of which ``cells`` are the first (row, value)."""
        for row, value in cells:
            self._add(Finding(severity, self.file, column, row, value, problem, remedy))
        self._rest[severity, column, problem] += total - len(cells)

    def _add(self, finding: Finding) -> None:
        kind = (finding.severity, finding.column, finding.problem)
        listed = self._listed.setdefault(kind, [])
        if len(listed) < ROWS_LISTED:
            listed.append(finding)
        else:
            self._rest[kind] += 1


def raise_on_errors(findings: Sequence[Finding]) -> None:
    """Raise one error that lists every error among ``findings``; return if there is none.

    Raises
    ------
    OdisarError
        With a table of file, row, column, value, problem and way out.
    """
    errors = [finding for finding in findings if finding.severity == "error"]
    if not errors:
        return
    files = len({finding.file for finding in errors})
    raise OdisarError(
        f"the recordings cannot be used: {_count(len(errors), 'finding')} "
        f"in {_count(files, 'place')}\n\n"
        f"{_aligned(errors)}\n\n"
        "Mend the files (or the case in params.yaml, where it is wrong about them) and run the "
        "same command again."
    )


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _printable(text: str) -> str:
    """Return text without what a file could steer a terminal with."""
    return "".join(character if character.isprintable() else "?" for character in text)


def _shorten(text: str) -> str:
    printable = _printable(text)
    if len(printable) <= _VALUE_WIDTH:
        return printable
    return printable[: _VALUE_WIDTH - 3] + "..."


def _aligned(findings: Iterable[Finding]) -> str:
    rows = [("file", "row", "column", "value", "problem", "what to do")]
    rows += [
        (
            _printable(finding.file),
            "" if finding.row is None else str(finding.row),
            _shorten(finding.column),
            _shorten(finding.value),
            _printable(finding.problem),
            _printable(finding.remedy),
        )
        for finding in findings
    ]
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    rows.insert(1, tuple("-" * width for width in widths))  # type: ignore[arg-type]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )


def quality_table(
    findings: Sequence[Finding],
    recordings: Sequence[Recording],
    files: Mapping[str, str] | None = None,
) -> pd.DataFrame:
    """Return a table of ``QUALITY_COLUMNS``: every recording read, and every file with a finding.

    ``files`` are the names of the files by recording; without them, the files named in findings
    are told by their stems and all others are taken for CSV files.
    ``seconds`` leaves the gaps out. A file with an error has no recording and so no samples.

    Raises
    ------
    ValueError
        If names repeat: findings and recordings are those of one case, matched by file name.
    """
    by_name = {recording.name: recording for recording in recordings}
    if len(by_name) < len(recordings):
        raise ValueError("quality_table takes one case at a time: recordings share a name")
    by_file: dict[str, list[Finding]] = {}
    for finding in findings:
        by_file.setdefault(finding.file, []).append(finding)
    if files is None:
        files = {Path(file).stem: Path(file).name for file in by_file}
    owners = {files.get(name, f"{name}.csv"): name for name in by_name}
    named = {Path(file).name for file in by_file}
    by_file |= {file: [] for file in owners if file not in named}
    rows = [
        _quality_row(file, found, by_name.get(owners.get(Path(file).name, "")))
        for file, found in sorted(by_file.items(), key=lambda item: Path(item[0]).name)
    ]
    return pd.DataFrame(rows, columns=list(QUALITY_COLUMNS))


def _quality_row(
    file: str, findings: Sequence[Finding], recording: Recording | None
) -> tuple[object, ...]:
    segments = recording.segments if recording else ()
    seconds = (
        sum(recording.time_s[stop - 1] - recording.time_s[start] for start, stop in segments)
        if recording
        else 0.0
    )
    return (
        Path(file).name,
        len(recording.time_s) if recording else 0,
        float(seconds),
        len(segments),
        max(len(segments) - 1, 0),
        sum(finding.severity == "error" for finding in findings),
        sum(finding.severity == "warning" for finding in findings),
        "; ".join(_sentence(finding) for finding in findings),
    )


def _sentence(finding: Finding) -> str:
    place = [f"row {finding.row}"] if finding.row is not None else []
    place += [_shorten(finding.column)] if finding.column else []
    place += [_shorten(finding.value)] if finding.value else []
    problem = _printable(finding.problem)
    return f"{problem} ({', '.join(place)})" if place else problem


def write_findings(path: Path, findings: Sequence[Finding]) -> None:
    """Write findings as a JSON list of objects, in the order they were found."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps([asdict(finding) for finding in findings], indent=1, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")


def read_findings(path: Path) -> list[Finding]:
    """Read what ``write_findings`` wrote."""
    return [Finding(**entry) for entry in json.loads(path.read_text(encoding="utf-8"))]


def write_quality_table(path: Path, table: pd.DataFrame) -> None:
    """Write a quality table as CSV."""
    path.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(path, index=False, lineterminator="\n")


def read_quality_table(path: Path) -> pd.DataFrame:
    """Read what ``write_quality_table`` wrote."""
    return pd.read_csv(path, keep_default_na=False)
