"""Scores of a forecast window, from what the twin says at time t and from nothing later."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating[Any]]


def state_reconstruction_errors(forecast: FloatArray, reconstruction: FloatArray) -> FloatArray:
    """Return (window, state) RMS over the horizon of reconstruction - forecast, scaled.

    ``forecast`` and ``reconstruction`` are (window, step, state). Paper, Eq. (rmse).
    """
    return np.asarray(np.sqrt(np.mean((reconstruction - forecast) ** 2, axis=1)))


def reconstruction_error(state_errors: FloatArray) -> FloatArray:
    """Return (window,) root mean square over steps and states, from the errors of each state."""
    return np.asarray(np.sqrt(np.mean(state_errors**2, axis=1)))


def predictive_variance(forecasts: FloatArray) -> FloatArray:
    """Return (window,) population variance over draws, mean over steps and states, scaled.

    ``forecasts`` is (draw, window, step, state). Paper, Eq. (variance).
    """
    return np.asarray(forecasts.var(axis=0).mean(axis=(1, 2)))
