"""Thresholds from calibration recordings, which nothing else has seen."""

import numpy as np
from numpy.typing import NDArray

from odisar.errors import OdisarError


def sigma_threshold(scores: NDArray[np.floating], sigmas: float) -> float:
    """Return mu + k sigma of calibration scores (paper, Eq. (thresholds)); NaN scores don't count.

    Raises OdisarError where there are too few scores to have a spread.
    """
    known = scores[np.isfinite(scores)].astype(np.float64)
    if known.size < 2:
        raise OdisarError(
            f"{known.size} calibration scores cannot set a threshold; add calibration recordings "
            "or shorten the window"
        )
    return float(known.mean() + sigmas * known.std())
