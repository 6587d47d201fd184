"""Look at the first rows of a Parquet file."""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa  # type: ignore[import-untyped]
from pyarrow import parquet

from odisar.proposals.samples import HEAD_ROWS, Sample, UnusableError


def sniff_parquet(path: Path) -> Sample:
    """Return the first rows of a Parquet file; raise UnusableError where there are none."""
    if path.is_dir():
        raise UnusableError("it is a folder, not a file")
    try:
        with parquet.ParquetFile(path) as file:
            rows = file.metadata.num_rows
            batch = next(file.iter_batches(HEAD_ROWS, use_threads=False), None)
    except (OSError, ValueError, pa.ArrowException) as fault:
        reason = " ".join(str(fault).split())
        raise UnusableError(f"it cannot be read as Parquet ({reason})") from fault
    if batch is None or not batch.num_rows:
        raise UnusableError("it has no samples")
    columns: dict[str, pd.Series[float] | pd.Series[str]] = {}
    for name, column in zip(batch.schema.names, batch.columns, strict=True):
        columns.setdefault(name, _column(column))
    remarks = () if batch.num_rows == rows else (f"only its first {HEAD_ROWS} rows were looked at",)
    clocks = [field.name for field in batch.schema if pa.types.is_timestamp(field.type)]
    return Sample(path, pd.DataFrame(columns), units=dict.fromkeys(clocks, "s"), remarks=remarks)


def _column(column: pa.Array) -> "pd.Series[float] | pd.Series[str]":
    """Return numbers and booleans as floats, timestamps as seconds, anything else as text."""
    kind = column.type
    if pa.types.is_dictionary(kind):
        column, kind = column.cast(kind.value_type), kind.value_type
    if pa.types.is_timestamp(kind):
        ticks = column.cast(pa.timestamp("us"), safe=False).cast(pa.int64()).to_pandas()
        return pd.Series(np.asarray(ticks - ticks.min(), dtype=float) / 1e6)
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
        return pd.Series(np.asarray(column.cast(pa.float64(), safe=False).to_pandas(), dtype=float))
    if pa.types.is_nested(kind):
        return pd.Series(["nested"] * len(column))
    return pd.Series([str(cell) for cell in column.cast(pa.string()).fill_null("").to_pylist()])
