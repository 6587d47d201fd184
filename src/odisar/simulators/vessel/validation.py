"""Hold the equations against a sea trial: R/V Gunnerus, 27 October 2022.

The trial is NTNU's public recording of zigzags and turning circles (``RVG_ManeuveringTests.csv``
in NTNU-MCS, MCSim_python). The model's authors calibrated it on this trial, so agreement validates
the implementation and not how well the model generalises.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from odisar.errors import OdisarError
from odisar.simulators.vessel.dynamics import Current, Orders, advance, no_force
from odisar.simulators.vessel.hull import Array, gunnerus

#: Where the state is set to the measured one, between manoeuvres [s].
_RESETS_S = (
    *(0, 450, 750, 1100, 1450, 1600, 1950, 2250, 2600, 2950, 3250, 3700, 4100),
    *(4375, 4650, 5025, 5300, 5950, 6250, 6900, 7100, 7550, 7800, 8200, 8500),
)
_STEP_S = 0.5
_CURRENT_M_S, _CURRENT_TOWARDS_DEG = 0.15, 70.0
#: The sway sensor lies ahead of the centre of gravity [m].
_SENSOR_X_M = 2.0
_COLUMNS = ("tvec", "phi", "psi", "u", "v", "r", "Azi", "RPM")
#: Column of the recording and unit of each compared state.
_STATES = {"Surge Speed": "m/s", "Sway Speed": "m/s", "Yaw Rate": "deg/s", "Roll Angle": "deg"}


def validation_traces(csv: Path) -> pd.DataFrame:
    """Return the trial, measured and simulated, as a long table.

    Columns: ``time_s``, ``state``, ``unit``, ``measured``, ``simulated``; sway at the sensor, and
    roll positive with starboard down; the mean of the measured roll counts as the sensor's
    offset. Raises ``OdisarError`` where the file is missing or lacks a column.
    """
    trial = _read_trial(csv)
    roll = trial["phi"].to_numpy() - trial["phi"].mean()
    u, v, r, phi = _simulate(trial, roll)
    pairs = (
        (trial["u"].to_numpy(), u),
        (trial["v"].to_numpy(), v + _SENSOR_X_M * r),
        (trial["r"].to_numpy(), np.rad2deg(r)),
        (roll, -np.rad2deg(phi)),
    )
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "time_s": trial["tvec"].to_numpy(),
                    "state": state,
                    "unit": unit,
                    "measured": measured,
                    "simulated": simulated,
                }
            )
            for (state, unit), (measured, simulated) in zip(_STATES.items(), pairs, strict=True)
        ],
        ignore_index=True,
    )


def sea_trial_table(csv: Path) -> pd.DataFrame:
    """Return RMSE and correlation of each state: columns ``state, unit, rmse, correlation``."""
    rows = []
    for (state, unit), group in validation_traces(csv).groupby(["state", "unit"], sort=False):
        measured, simulated = group["measured"].to_numpy(), group["simulated"].to_numpy()
        rows.append(
            {
                "state": state,
                "unit": unit,
                "rmse": float(np.sqrt(np.mean((measured - simulated) ** 2))),
                "correlation": float(np.corrcoef(measured, simulated)[0, 1]),
            }
        )
    return pd.DataFrame(rows)


def _read_trial(csv: Path) -> pd.DataFrame:
    if not csv.is_file():
        raise OdisarError(
            f"{csv} is not a file; it should be RVG_ManeuveringTests.csv from NTNU's public "
            "repository MCSim_python"
        )
    trial = pd.read_csv(csv)
    missing = [column for column in _COLUMNS if column not in trial.columns]
    if missing:
        raise OdisarError(f"{csv}: column {missing[0]!r} is missing")
    return trial


def _simulate(trial: pd.DataFrame, roll_deg: Array) -> Array:
    """Return (state, sample): u, v, r and roll, simulated between resets as runs side by side."""
    starts = np.searchsorted(trial["tvec"].to_numpy(), _RESETS_S)
    ends = np.append(starts[1:], len(trial))
    hull = gunnerus()
    azimuth = np.deg2rad(trial["Azi"].to_numpy())
    rpm = trial["RPM"].to_numpy()
    state = _measured_state(trial, roll_deg)[:, starts]
    towards = np.deg2rad(_CURRENT_TOWARDS_DEG)
    current = Current(
        np.full(len(starts), _CURRENT_M_S * np.cos(towards)),
        np.full(len(starts), _CURRENT_M_S * np.sin(towards)),
    )
    calm = no_force(len(starts))
    simulated = np.empty((4, len(trial)))
    for step in range(int(np.max(ends - starts))):
        # A run that reached the next reset sails on unseen, so that all runs keep one length.
        sample = np.minimum(starts + step, len(trial) - 1)
        seen = starts + step < ends
        simulated[:, sample[seen]] = state[[4, 5, 7, 2]][:, seen]
        orders = Orders(azimuth[sample], rpm[sample])
        state = advance(hull, state, orders, current, (calm, calm, calm), _STEP_S)
    return simulated


def _measured_state(trial: pd.DataFrame, roll_deg: Array) -> Array:
    """Return (row, sample): the state as measured, with the sway at the centre of gravity."""
    yaw_rate = np.deg2rad(trial["r"].to_numpy())
    zero = np.zeros(len(trial))
    return np.stack(
        [
            zero,
            zero,
            -np.deg2rad(roll_deg),
            np.deg2rad(trial["psi"].to_numpy()),
            trial["u"].to_numpy(),
            trial["v"].to_numpy() - _SENSOR_X_M * yaw_rate,
            zero,
            yaw_rate,
            np.deg2rad(trial["Azi"].to_numpy()),
            trial["RPM"].to_numpy(),
        ]
    )
