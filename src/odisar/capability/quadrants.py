"""The four confidence quadrants (paper, section "Creating DTC")."""

from enum import StrEnum


class Quadrant(StrEnum):
    """In or out of distribution, confident or uncertain; the value is the paper's colour."""

    IND_CONFIDENT = "green"
    IND_UNCERTAIN = "yellow"
    OOD_UNCERTAIN = "orange"
    OOD_CONFIDENT = "red"


def quadrant(*, is_ood: bool, is_uncertain: bool) -> Quadrant:
    """Return the quadrant of a window's two flags."""
    if is_ood:
        return Quadrant.OOD_UNCERTAIN if is_uncertain else Quadrant.OOD_CONFIDENT
    return Quadrant.IND_UNCERTAIN if is_uncertain else Quadrant.IND_CONFIDENT
