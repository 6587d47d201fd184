"""How near test recordings are to what the twin has seen: repeats must not be copies."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.neighbors import NearestNeighbors

from odisar.recordings.schema import Recording
from odisar.windows.coordinates import features
from odisar.windows.scaling import Scaler
from odisar.windows.windowing import WindowSpec

# A sixth of the context apart: near enough that a copy, shifted, would still be found.
_STRIDE_SHARE = 6


def nearness_table(
    member: str, splits: Mapping[str, Sequence[Recording]], scaler: Scaler, spec: WindowSpec
) -> pd.DataFrame:
    """Return quantiles of the distance to the nearest training window, by split.

    Distances are root mean squares over steps and features of scaled contexts: a copy is at 0,
    two unrelated windows at about 1.4. Only undisturbed recordings count.
    """
    train = _contexts(splits["train"], scaler, spec)
    search = NearestNeighbors(n_neighbors=1).fit(train)
    rows = []
    for split in ("validation", "calibration", "test"):
        clean = [recording for recording in splits[split] if not recording.info.is_disturbed]
        if not clean:
            continue
        distances = search.kneighbors(_contexts(clean, scaler, spec))[0][:, 0]
        scaled = distances / np.sqrt(train.shape[1])
        low, median, high = np.quantile(scaled, [0.01, 0.5, 0.99])
        rows.append(
            {
                "member": member,
                "split": split,
                "windows": len(scaled),
                "smallest": scaled.min(),
                "quantile_01": low,
                "median": median,
                "quantile_99": high,
            }
        )
    return pd.DataFrame(rows)


def _contexts(
    recordings: Sequence[Recording], scaler: Scaler, spec: WindowSpec
) -> NDArray[np.float32]:
    stride = max(1, spec.context_steps // _STRIDE_SHARE)
    back = np.arange(1 - spec.context_steps, 1)
    parts = [np.empty((0, spec.context_steps * len(scaler.mean)), dtype=np.float32)]
    for recording in recordings:
        scaled = scaler.scale(features(recording, spec.pose))
        for segment in recording.segments:
            positions = spec.issue_positions(segment, stride, horizon_steps=0)
            parts.append(scaled[positions[:, None] + back].reshape(len(positions), -1))
    return np.concatenate(parts)
