"""Columns of text in any file, also in those that were not looked at for the proposal."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from odisar.proposals.csv_sniffing import sniff_csv
from odisar.proposals.gathering import Look
from odisar.proposals.parquet_sniffing import sniff_parquet
from odisar.proposals.samples import Sample, UnusableError
from odisar.recordings.folder import format_of
from odisar.recordings.quality import Finding
from odisar.recordings.reader import ReadResult

_UNDECLARED = "the column is not declared"
_REMEDY = "nothing: it holds text, which cannot be a channel"
_FILES_LOOKED_AT = 12


def columns_of_text(look: Look, findings: Sequence[Finding]) -> list[str]:
    """Return the columns that hold text, those of files not yet looked at by the ``findings``."""
    tables = [sample.table for sample in look.samples]
    seen = {str(name) for table in tables for name in table.columns}
    unseen: dict[str, str] = {}
    for finding in findings:
        if finding.problem.startswith(_UNDECLARED) and finding.column not in seen:
            unseen.setdefault(finding.column, Path(finding.file).name)
    paths = {path.name: path for path in look.files}
    files = [name for name in dict.fromkeys(unseen.values()) if name in paths]
    for name in files[:_FILES_LOOKED_AT]:
        sample = _look_at(paths[name])
        tables += [sample.table] if sample else []
    return list(dict.fromkeys(name for table in tables for name in _text_in(table)))


def _text_in(table: pd.DataFrame) -> list[str]:
    return [str(name) for name in table if not pd.api.types.is_numeric_dtype(table[name])]


def _look_at(path: Path) -> Sample | None:
    form = format_of(path)
    if form == "bag":
        return None
    try:
        return sniff_parquet(path) if form == "parquet" else sniff_csv(path)
    except UnusableError:
        return None


def without_advice(result: ReadResult, text_columns: Sequence[str]) -> ReadResult:
    """Return what was read, without the advice to make channels of columns of text."""
    findings = [
        replace(finding, remedy=_REMEDY)
        if finding.column in text_columns and finding.problem.startswith(_UNDECLARED)
        else finding
        for finding in result.findings
    ]
    return replace(result, findings=findings)
