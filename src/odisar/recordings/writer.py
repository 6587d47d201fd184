"""Write recordings as the CSV folder that the reader takes: the same recordings, the same bytes."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import pandas as pd

from odisar.recordings.schema import INDEX_COLUMNS, LABEL_COLUMNS, Recording

_DECIMALS = "%.6f"


def write_recordings(
    folder: Path, recordings: Iterable[Recording], channel_names: Sequence[str]
) -> list[Path]:
    r"""Write one CSV a recording, ``recordings.csv`` (metadata) and ``labels.csv`` (intervals).

    Six decimals and ``\n`` line ends, so that the bytes are equal on every machine that rounds
    the sixth decimal alike. Returns the files written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    index_rows: list[dict[str, object]] = []
    label_rows: list[dict[str, object]] = []
    written: list[Path] = []
    for recording in recordings:
        path = folder / f"{recording.name}.csv"
        table = pd.DataFrame(recording.values, columns=list(channel_names))
        table.insert(0, "time_s", recording.time_s)
        table.to_csv(path, index=False, float_format=_DECIMALS, lineterminator="\n")
        written.append(path)
        index_rows.append(_index_row(recording))
        label_rows.extend(
            {
                "recording": recording.name,
                "start_s": interval.start_s,
                "end_s": interval.end_s,
                "label": interval.label,
            }
            for interval in recording.intervals
        )
    for name, rows, columns in (
        ("recordings.csv", index_rows, INDEX_COLUMNS),
        ("labels.csv", label_rows, LABEL_COLUMNS),
    ):
        table = pd.DataFrame(rows) if rows else pd.DataFrame(columns=list(columns))
        table.to_csv(folder / name, index=False, lineterminator="\n")
        written.append(folder / name)
    return written


def _index_row(recording: Recording) -> dict[str, object]:
    info = recording.info
    row: dict[str, object] = {"recording": recording.name}
    row |= {column: info.column(column) for column in INDEX_COLUMNS if column != "recording"}
    return row | dict(info.extra)
