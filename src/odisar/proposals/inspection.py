"""What `odisar inspect` prints: files, findings and channels of a folder of recordings."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from odisar.config.cases import Case, Channel
from odisar.proposals.tables import printable, shortened, table
from odisar.recordings.quality import Finding, quality_table
from odisar.recordings.reader import ReadResult
from odisar.recordings.schema import Recording

# Of a kind: errors are mended one by one, warnings are taken note of.
_SHOWN = {"error": 4, "warning": 1}
_FINDINGS = 120
_FILES = 200


@dataclass(frozen=True)
class Inspection:
    """A quality report as text, how many kinds of error it tells of, and all counts in words."""

    text: str
    errors: int
    counts: str


def inspect_case(case: Case, result: ReadResult, origin: str) -> Inspection:
    """Return the report on recordings that were read as a case declares; ``origin`` names it."""
    parts = [
        printable(f"{case.source.folder}, read as {origin}"),
        _summary(case, result),
        _files(result),
        _findings(result.findings),
        _channels(case, result.recordings),
    ]
    text = "\n\n".join(part for part in parts if part)
    errors = sum(finding.severity == "error" for finding in result.findings)
    return Inspection(text, errors, counts_of(result.findings))


def counts_of(findings: Sequence[Finding]) -> str:
    """Return "3 errors (2 kinds), 1 warning": every place counts, also those not listed."""
    told = []
    for severity in ("error", "warning"):
        found = [finding for finding in findings if finding.severity == severity]
        places, kinds = sum(map(_rows, found)), len({_sort(finding) for finding in found})
        apart = f" of {plural(kinds, 'kind')}" if places > 1 else ""
        told.append(f"{plural(places, severity)}{apart}")
    return ", ".join(told)


def _sort(finding: Finding) -> tuple[str, str, str, str]:
    return finding.severity, finding.column, finding.problem, finding.remedy


def plural(number: int, noun: str) -> str:
    """Return a number with its noun."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _summary(case: Case, result: ReadResult) -> str:
    sound, files = len(result.recordings), len(result.files)
    samples = sum(len(recording.time_s) for recording in result.recordings)
    hours = samples / case.rate_hz / 3600.0
    rate = f"{case.rate_hz:g} Hz, resampled" if case.source.resample != "none" else _rates(result)
    return (
        f"{sound} of {plural(files, 'recording')} can be used: {hours:.3g} h, "
        f"{plural(samples, 'sample')}, {rate or f'{case.rate_hz:g} Hz declared'}"
    )


def _rates(result: ReadResult) -> str:
    steps = [np.median(np.diff(item.time_s)) for item in result.recordings if len(item.time_s) > 1]
    if not steps:
        return ""
    slowest, fastest = 1.0 / max(steps), 1.0 / min(steps)
    if fastest < 1.01 * slowest:
        return f"measured {slowest:.4g} Hz"
    return f"measured {slowest:.4g} to {fastest:.4g} Hz"


def _files(result: ReadResult) -> str:
    if not result.files:
        return ""
    quality = quality_table(result.findings, result.recordings, result.files)
    rows = [
        [
            shortened(str(row["file"]), 48),
            *(str(row[name]) if row["samples"] else "" for name in ("samples",)),
            f"{row['seconds']:.6g}" if row["samples"] else "",
            *(str(row[name]) if row["samples"] else "" for name in ("segments", "gaps")),
            *(str(row[name]) if row[name] else "" for name in ("errors", "warnings")),
        ]
        for row in quality.to_dict("records")
    ]
    header = ("file", "samples", "seconds", "segments", "gaps", "errors", "warnings")
    rest = len(rows) - _FILES
    text = table(header, rows[:_FILES])
    return f"{text}\n... and {rest} more files" if rest > 0 else text


def _findings(findings: Sequence[Finding]) -> str:
    """Return a table of findings, errors first, a few of each kind."""
    if not findings:
        return "No findings."
    kinds: dict[tuple[str, str, str, str], list[Finding]] = {}
    for finding in sorted(findings, key=lambda item: item.severity):
        kinds.setdefault(_sort(finding), []).append(finding)
    rows = [row for kind in kinds.values() for row in _kind_rows(kind)]
    header = ("", "file", "row", "column", "value", "problem", "what to do")
    text = table(header, rows[:_FINDINGS], wrapped=(5, 6))
    rest = len(rows) - _FINDINGS
    return f"{text}\n... and {plural(rest, 'more row')}" if rest > 0 else text


def _kind_rows(kind: Sequence[Finding]) -> list[list[str]]:
    """Return the first findings of a kind in full; of the others, how many there are."""
    most = _SHOWN[kind[0].severity]
    shown, rest = kind[:most], kind[most:]
    rows = [_row(finding) for finding in shown]
    for row in rows[1:]:
        row[5], row[6] = '"', '"'
    if rest:
        files = len({finding.file for finding in rest})
        more = f"{sum(map(_rows, rest))} more in {plural(files, 'file')}"
        rows.append(["", more, "", "", "", "", ""])
    return rows


def _rows(finding: Finding) -> int:
    """Return how many rows a finding stands for: the last of many is "and 397 more"."""
    counted = re.fullmatch(r"and (\d+) more", finding.value) if finding.row is None else None
    return int(counted[1]) if counted else 1


def _row(finding: Finding) -> list[str]:
    return [
        finding.severity,
        shortened(Path(finding.file).name, 24),
        "" if finding.row is None else str(finding.row),
        shortened(finding.column, 16),
        shortened(finding.value, 16),
        finding.problem,
        finding.remedy,
    ]


def _channels(case: Case, recordings: Sequence[Recording]) -> str:
    if not recordings:
        return "No recording is free of errors: what the channels hold is not shown."
    values = np.concatenate([recording.values for recording in recordings])
    held = np.concatenate(
        [
            np.diff(recording.values[start:stop], axis=0) == 0
            for recording in recordings
            for start, stop in recording.segments
        ]
    )
    rows = []
    for i, channel in enumerate(case.channels):
        column = values[:, i]
        rows.append(
            [
                shortened(channel.name, 32),
                channel.unit,
                "forecast" if channel.output else channel.role,
                f"{column.min():.4g}",
                f"{column.mean():.4g}",
                f"{column.max():.4g}",
                f"{column.std():.3g}",
                f"{100 * held[:, i].mean():.0f} %" if len(held) else "",
                f"{channel.min:g} to {channel.max:g}",
                _remark(channel, float(column.min()), float(column.max())),
            ]
        )
    header = ["channel", "unit", "role", "min", "mean", "max", "sd", "held", "limits", "remark"]
    if not any(row[-1] for row in rows):
        header, rows = header[:-1], [row[:-1] for row in rows]
    return table(header, rows, wrapped=(len(header) - 1,))


def _remark(channel: Channel, low: float, high: float) -> str:
    """Say where what was seen and what is declared don't look like each other."""
    span = channel.max - channel.min
    if high - low < 0.002 * span:
        return "limits far wider than seen"
    # Limits of 0 and 1 are met by whatever is a share.
    below = abs(channel.min) > 1.01 and low < channel.min + 0.02 * span
    above = abs(channel.max) > 1.01 and high > channel.max - 0.02 * span
    if below or above:
        return "close to a limit"
    return ""
