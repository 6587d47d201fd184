"""Tables over assessed windows: how confident (quadrants), and which states (attribution).

Both read one row per assessed window with the columns setup, recording, base_seed, maneuver,
disturbance, components, strength, is_disturbed (at the time of issue), category, and state_1,
state_2, state_3 (most abnormal first; empty unless flagged), and any other metadata column that
the groups name.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.config.cases import Groups
from odisar.config.judging import Judging
from odisar.errors import OdisarError
from odisar.evaluation.cells import Cell, cell_resampler, disturbed_cells, metadata_columns
from odisar.evaluation.published import PublishedShare, is_full_strength, published_shares

#: IND and confident, IND and uncertain, OOD and uncertain, OOD and confident.
QUADRANTS = ("green", "yellow", "orange", "red")
FLAGGED = ("orange", "red")

STATE_COLUMNS = ("state_1", "state_2", "state_3")

QUADRANT_COLUMNS = (
    "setup",
    "evaluated_on",
    "strength",
    "quadrant",
    "share",
    "ci_low",
    "ci_high",
    "windows",
    "share_of_disturbed",
    "share_of_undisturbed",
    "published_low",
    "published_high",
    "published",
)

ATTRIBUTION_COLUMNS = (
    "setup",
    "evaluated_on",
    "strength",
    "state",
    "flagged_windows",
    "top_1",
    "top_3",
)

_NOT_PUBLISHED = PublishedShare(float("nan"), float("nan"), "")


def quadrant_table(
    assessed: pd.DataFrame,
    case_groups: Groups,
    cfg: Judging,
    base_seed: int,
    published_as: Mapping[str, str | None],
) -> pd.DataFrame:
    """Return the share of windows in each quadrant, per set-up, scenario and strength.

    The windows are those of disturbed recordings, before, in and after their events, as in the
    paper's RQ2. The shares among disturbed and among undisturbed windows stand beside it.
    """
    rows = []
    for setup, cell, parts in _cells(assessed, case_groups):
        counts = np.stack([_quadrant_counts(part) for part in parts])
        totals = counts.sum(axis=(0, 1))
        by_label = counts.sum(axis=0)
        clusters = [_cluster(part) for part in parts]
        resampler = cell_resampler(cell, clusters, cfg, base_seed)
        drawn = resampler.totals(counts.sum(axis=1))
        for number, quadrant in enumerate(QUADRANTS):
            low, high = resampler.interval(drawn[:, number] / drawn.sum(axis=1))
            published = _published(published_as.get(setup), cell, quadrant)
            values = (
                setup,
                cell.evaluated_on,
                cell.strength_or_nan,
                quadrant,
                totals[number] / totals.sum(),
                low,
                high,
                int(totals.sum()),
                _share(by_label[1], number),
                _share(by_label[0], number),
                published.low,
                published.high,
                published.statement,
            )
            rows.append(dict(zip(QUADRANT_COLUMNS, values, strict=True)))
    return pd.DataFrame(rows, columns=list(QUADRANT_COLUMNS))


def attribution_table(assessed: pd.DataFrame, case_groups: Groups) -> pd.DataFrame:
    """Return how often each state comes first, and among the first three, in flagged windows.

    ``top_1`` and ``top_3`` are shares of ``flagged_windows``; states that no flagged window of the
    set-up names have no rows, and a cell without a flagged window has none either.
    """
    rows = []
    for setup, cell, parts in _cells(assessed, case_groups):
        windows = pd.concat(parts)
        flagged = windows[windows["category"].isin(FLAGGED)]
        if flagged.empty:
            continue
        named = flagged[list(STATE_COLUMNS)].fillna("")
        for state in _states(assessed[assessed["setup"] == setup]):
            values = (
                setup,
                cell.evaluated_on,
                cell.strength_or_nan,
                state,
                len(named),
                float((named["state_1"] == state).mean()),
                float((named == state).any(axis=1).mean()),
            )
            rows.append(dict(zip(ATTRIBUTION_COLUMNS, values, strict=True)))
    return pd.DataFrame(rows, columns=list(ATTRIBUTION_COLUMNS))


def _cells(
    assessed: pd.DataFrame, groups: Groups
) -> Iterator[tuple[str, Cell, Sequence[pd.DataFrame]]]:
    """Yield set-up, cell, and the windows of each of the cell's recordings."""
    _check(assessed, groups)
    for setup in dict.fromkeys(assessed["setup"]):
        own = assessed[assessed["setup"] == setup]
        parts = [part for _, part in own.groupby("recording", sort=True)]
        descriptions = [
            {name: _text(part[name].iloc[0]) for name in metadata_columns(groups)} for part in parts
        ]
        for cell in disturbed_cells(descriptions, groups):
            yield str(setup), cell, [parts[i] for i in cell.members]


def _check(assessed: pd.DataFrame, groups: Groups) -> None:
    needed = ["setup", "recording", "base_seed", "is_disturbed", "category", *STATE_COLUMNS]
    missing = [n for n in [*needed, *metadata_columns(groups)] if n not in assessed.columns]
    if missing:
        raise OdisarError(
            f"assessed windows lack the columns {', '.join(missing)}; write them with the "
            "assessment, or change the groups that name them"
        )
    unknown = sorted(set(assessed["category"].astype(str)) - set(QUADRANTS))
    if unknown:
        raise OdisarError(
            f"assessed windows, column category: {unknown[0]!r} is none of {', '.join(QUADRANTS)}"
        )


def _text(value: object) -> str:
    return "" if pd.isna(value) else str(value)  # type: ignore[call-overload]


def _cluster(part: pd.DataFrame) -> str:
    return _text(part["base_seed"].iloc[0]) or _text(part["recording"].iloc[0])


def _states(windows: pd.DataFrame) -> list[str]:
    named = windows[list(STATE_COLUMNS)].to_numpy().ravel()
    return sorted({text for text in (_text(value) for value in named) if text})


def _quadrant_counts(part: pd.DataFrame) -> NDArray[np.float64]:
    """Return (2, quadrant) counts of one recording's windows, undisturbed first."""
    disturbed = part["is_disturbed"].to_numpy(dtype=bool)
    categories = part["category"].to_numpy(dtype=str)
    return np.array(
        [
            [np.sum((categories == quadrant) & (disturbed == label)) for quadrant in QUADRANTS]
            for label in (False, True)
        ],
        dtype=np.float64,
    )


def _share(counts: NDArray[np.float64], number: int) -> float:
    total = counts.sum()
    return float(counts[number] / total) if total else float("nan")


def _published(setup: str | None, cell: Cell, quadrant: str) -> PublishedShare:
    if setup is None or not is_full_strength(cell.strength_or_nan):
        return _NOT_PUBLISHED
    return published_shares().get((setup, quadrant), _NOT_PUBLISHED)
