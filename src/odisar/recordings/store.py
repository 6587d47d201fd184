"""The checked recordings as the pipeline keeps them: one Parquet table and one JSON file.

Both can be opened without this package, and the same recordings give the same bytes.
"""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from numpy.typing import NDArray
from pyarrow import parquet

from odisar.errors import OdisarError
from odisar.recordings.schema import Interval, Recording, RecordingInfo

SAMPLES_FILE = "samples.parquet"
METADATA_FILE = "recordings.json"


def write_store(
    path: Path, recordings: Sequence[Recording], channel_names: Sequence[str] | None = None
) -> None:
    """Write recordings into the folder ``path``: samples as Parquet, all else as JSON.

    The long table has the columns ``recording``, ``time_s`` and one a channel, called
    ``channel_names`` if given. 64-bit floats come back bit for bit.

    Raises
    ------
    OdisarError
        If the recordings do not have the same number of channels, or share a name.
    """
    channels = _channel_count(recordings, channel_names)
    _check_names(recordings)
    names = [f"channel_{i}" for i in range(channels)] if channel_names is None else channel_names
    path.mkdir(parents=True, exist_ok=True)
    lengths = [len(recording.time_s) for recording in recordings]
    time_s = np.concatenate([np.empty(0), *(recording.time_s for recording in recordings)])
    values = np.concatenate(
        [np.empty((0, channels)), *(recording.values for recording in recordings)]
    )
    numbers = np.repeat(np.arange(len(recordings), dtype=np.int32), lengths)
    names_of = pa.array([recording.name for recording in recordings], type=pa.string())
    columns = [pa.DictionaryArray.from_arrays(numbers, names_of), pa.array(time_s)]
    columns += [pa.array(np.ascontiguousarray(values[:, i])) for i in range(channels)]
    table = pa.Table.from_arrays(columns, names=["recording", "time_s", *names])
    parquet.write_table(
        table, path / SAMPLES_FILE, compression="zstd", use_dictionary=["recording"]
    )
    metadata = {
        "channels": list(names),
        "recordings": [_to_entry(recording) for recording in recordings],
    }
    text = json.dumps(metadata, indent=1, ensure_ascii=False, allow_nan=False)
    (path / METADATA_FILE).write_text(text + "\n", encoding="utf-8")


def read_store(path: Path) -> list[Recording]:
    """Read what ``write_store`` wrote, in the same order.

    Raises
    ------
    OdisarError
        If one of the two files is missing, or if they do not belong together.
    """
    for name in (SAMPLES_FILE, METADATA_FILE):
        if not (path / name).is_file():
            raise OdisarError(f"{path / name} is missing: run the preprocess stage (dvc repro)")
    try:
        metadata = json.loads((path / METADATA_FILE).read_text(encoding="utf-8"))
        table = parquet.read_table(path / SAMPLES_FILE, use_threads=False)
    except (OSError, ValueError) as error:  # pyarrow's errors are ValueErrors too
        raise OdisarError(
            f"{path}: damaged ({' '.join(str(error).split())}); run the preprocess stage again "
            "(dvc repro --force preprocess)"
        ) from error
    time_s = table.column("time_s").to_numpy()
    values = np.empty((len(time_s), table.num_columns - 2))
    for i in range(values.shape[1]):
        values[:, i] = table.column(i + 2).to_numpy()
    borders = np.cumsum([0, *(entry["samples"] for entry in metadata["recordings"])])
    if borders[-1] != len(time_s):
        raise OdisarError(
            f"{path / SAMPLES_FILE} has {len(time_s)} samples but {METADATA_FILE} tells of "
            f"{borders[-1]}: run the preprocess stage again (dvc repro)"
        )
    return [
        _from_entry(entry, time_s[start:stop].copy(), values[start:stop].copy())
        for entry, start, stop in zip(
            metadata["recordings"], borders[:-1], borders[1:], strict=True
        )
    ]


def _channel_count(recordings: Sequence[Recording], names: Sequence[str] | None) -> int:
    counts = {recording.values.shape[1] for recording in recordings}
    counts |= set() if names is None else {len(names)}
    if len(counts) > 1:
        raise OdisarError(
            f"recordings of {' and '.join(map(str, sorted(counts)))} channels do not fit in one "
            "store: write a store for each case"
        )
    return counts.pop() if counts else 0


def _check_names(recordings: Sequence[Recording]) -> None:
    counts = Counter(recording.name for recording in recordings)
    repeated = sorted(name for name, count in counts.items() if count > 1)
    if repeated:
        raise OdisarError(f"more than one recording is called {', '.join(repeated)}: rename them")


def _to_entry(recording: Recording) -> dict[str, Any]:
    return {
        "name": recording.name,
        "samples": len(recording.time_s),
        "info": {**asdict(recording.info), "extra": dict(recording.info.extra)},
        "intervals": [asdict(interval) for interval in recording.intervals],
        "segments": [[int(start), int(stop)] for start, stop in recording.segments],
    }


def _from_entry(
    entry: Mapping[str, Any], time_s: NDArray[np.float64], values: NDArray[np.float64]
) -> Recording:
    return Recording(
        name=entry["name"],
        info=RecordingInfo(**entry["info"]),
        time_s=time_s,
        values=values,
        intervals=tuple(Interval(**interval) for interval in entry["intervals"]),
        segments=tuple((start, stop) for start, stop in entry["segments"]),
    )
