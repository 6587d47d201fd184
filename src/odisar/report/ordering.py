"""The order in which scenarios are told: fault sizes as numbers, everything else as text."""

import pandas as pd


def size_key(size: str) -> tuple[float, str]:
    """Return what to order a fault's size by, as in "1.2 s": its number, then its unit."""
    amount, _, unit = size.partition(" ")
    try:
        return float(amount), unit
    except ValueError:  # a stuck sensor has no size
        return float("-inf"), size


def ordered_values(recordings: pd.DataFrame, column: str) -> list[str]:
    """Return the values of a metadata column in order; none where there is no such column.

    Sizes of faults follow the kind of the fault, since a delay's seconds and a bias's standard
    deviations are no one scale; ``fault`` and ``fault_on`` begin with the kind.
    """
    if column not in recordings:
        return []
    values = set(recordings[column].dropna().astype(str))
    if column in ("fault", "fault_on"):
        return sorted(values, key=fault_key)
    if column != "fault_size":
        return sorted(values)
    kinds = recordings.groupby("fault_size").disturbance.min()
    return sorted(values, key=lambda size: (kinds[size], *size_key(size)))


def fault_key(fault: str) -> tuple[str, float, str]:
    """Return what to order "noise 0.1 m/s, Speed" by: kind, size, the rest."""
    kind, _, size = fault.partition(" ")
    return kind, *size_key(size)
