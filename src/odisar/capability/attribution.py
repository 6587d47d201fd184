"""Which states to blame for a flagged window (paper, section "Explainable OOD Detection")."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def top_states(
    state_errors: NDArray[np.floating], names: Sequence[str], top: int
) -> dict[str, float]:
    """Return the ``top`` states with the largest share (state,) in a score, largest first."""
    order = np.argsort(-state_errors, kind="stable")[:top]
    return {names[i]: float(state_errors[i]) for i in order}
