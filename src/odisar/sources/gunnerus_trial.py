"""The published file of R/V Gunnerus' sea trial: read, checked and averaged.

Source: NTNU, repository MCSim_python, ``RVG_ManeuveringTests.csv`` (GPL-3): 8,850 s at 2 Hz, two
azimuth thrusters aft. Columns read, with the units found in the file (it states none):

========  =====  ==================================================================================
column    unit   how the unit shows
========  =====  ==================================================================================
``tvec``  s      steps of 0.5 from 0 to 8850
``Azi``   deg    reaches 44 and holds plateaus of 10, 20 and 30: orders of zigzags and circles
``RPM``   1/min  65 to 205
``u``     m/s    agrees with the differentiated position along the heading
``v``     m/s    as ``u``, across the heading; positive to starboard
``r``     deg/s  agrees with the differentiated heading (whose unit is deg: 0 to 360)
``phi``   deg    reaches 5.7, positive with the starboard side down
========  =====  ==================================================================================

Position and heading aren't read: heading was interpolated across 360/0 (77 jumps).
"""

from pathlib import Path

import numpy as np
import pandas as pd

from odisar.config.sources import GunnerusConfig
from odisar.errors import OdisarError

#: Channels in the order of the value array's last axis.
CHANNEL_NAMES = (
    "Azimuth Angle",
    "Propeller Speed",
    "Surge Speed",
    "Sway Speed",
    "Yaw Rate",
    "Roll Angle",
    "Roll Rate",
)

_TIME = "tvec"
_COLUMNS = {
    "Azi": "Azimuth Angle",
    "RPM": "Propeller Speed",
    "u": "Surge Speed",
    "v": "Sway Speed",
    "r": "Yaw Rate",
    "phi": "Roll Angle",
}
_TIME_TOLERANCE_S = 1.0e-6


def read_trial(csv: Path, config: GunnerusConfig) -> pd.DataFrame:
    """Return the columns of the file that are used, checked (the one boundary)."""
    try:
        raw = pd.read_csv(csv)
    except (OSError, ValueError) as error:
        raise OdisarError(f"{csv}: cannot be read as CSV ({error}); fetch it again") from error
    missing = [name for name in (_TIME, *_COLUMNS) if name not in raw.columns]
    if missing:
        raise OdisarError(
            f"{csv}: no column {', '.join(missing)}; found {', '.join(map(str, raw.columns))}; "
            "give the file as published"
        )
    raw = raw[[_TIME, *_COLUMNS]]
    numbers: pd.DataFrame = raw.apply(pd.to_numeric, errors="coerce").astype(np.float64)
    bad = np.argwhere(~np.isfinite(numbers.to_numpy()))
    if len(bad):
        row, column = (int(i) for i in bad[0])
        raise OdisarError(
            f"{csv}: row {row + 2}, column {raw.columns[column]}: {raw.iloc[row, column]!r} is "
            "not a number; give the file as published"
        )
    steps = np.diff(numbers[_TIME].to_numpy())
    wrong = np.flatnonzero(np.abs(steps - 1 / config.raw_rate_hz) > _TIME_TOLERANCE_S)
    if len(wrong):
        raise OdisarError(
            f"{csv}: row {wrong[0] + 3}, column {_TIME}: a step of {steps[wrong[0]]:g} s where "
            f"sources.gunnerus.raw_rate_hz={config.raw_rate_hz} says {1 / config.raw_rate_hz:g} s"
        )
    return numbers


def average(raw: pd.DataFrame, config: GunnerusConfig) -> pd.DataFrame:
    """Return the channels at ``rate_hz``, from the second averaged sample on."""
    size = config.average_samples
    whole = len(raw) // size * size
    groups = raw[list(_COLUMNS)].to_numpy()[:whole].reshape(-1, size, len(_COLUMNS))
    table = pd.DataFrame(groups.mean(axis=1), columns=list(_COLUMNS.values()))
    table["Roll Angle"] *= config.roll_sign
    table["Roll Rate"] = table["Roll Angle"].diff() * config.rate_hz
    return table[list(CHANNEL_NAMES)].iloc[1:].reset_index(drop=True)
