"""The forecast-error baseline (RMSE), available when the truth is, not before.

The paper compares a forecast with the truth of its own horizon. A monitor has that truth h steps
later: at time t it can judge the forecast issued at t - h.
"""

import numpy as np
from numpy.typing import NDArray


def forecast_rmse(
    forecast: NDArray[np.float32], truth: NDArray[np.float32], lead_steps: int
) -> NDArray[np.float32]:
    """Return (window,) root mean square over the first ``lead_steps`` steps and all states.

    ``forecast`` and ``truth`` are (window, step, state), scaled; NaN where the truth is missing.
    """
    error = forecast[:, :lead_steps] - truth[:, :lead_steps]
    return np.asarray(np.sqrt(np.mean(error**2, axis=(1, 2))), dtype=np.float32)


def delayed(by_issue: NDArray[np.float32], lead_steps: int) -> NDArray[np.float32]:
    """Return (window,) what is known at t: the error of the forecast issued ``lead_steps`` before.

    The windows are consecutive positions of one segment; the first ``lead_steps`` have no answer.
    """
    known = np.full_like(by_issue, np.nan)
    if lead_steps < len(by_issue):
        known[lead_steps:] = by_issue[:-lead_steps]
    return known
