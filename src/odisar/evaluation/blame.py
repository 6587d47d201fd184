"""Is the guilty channel named? Judged where a fault was put on a known one."""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.config.judging import Judging
from odisar.evaluation.intervals import Resampler
from odisar.seeding import generator

#: How the states of a window were ranked: by what explains the innovations, and as the paper does.
ATTRIBUTIONS = {"odisar": "state", "reconstruction": "rebuilt_state"}

BLAME_COLUMNS = (
    "setup",
    "attribution",
    "fault",
    "guilty",
    "windows",
    "recordings",
    "hit_1",
    "hit_1_low",
    "hit_1_high",
    "hit_3",
    "hit_3_low",
    "hit_3_high",
    "chance_1",
    "chance_3",
)

ANY = "any"


def blame_table(assessed: pd.DataFrame, cfg: Judging, base_seed: int) -> pd.DataFrame:
    """Return how often the guilty channel comes first, and among the first three.

    ``assessed`` has a row for each assessed window, with setup, recording, base_seed, fault,
    guilty (the channel that a fault was put on, empty where none was), is_disturbed, and for
    each of ``ATTRIBUTIONS`` three columns of named states, empty unless its score was above its
    threshold, and its chance (``named_by_chance``). Only flagged
    windows inside of a fault count: on others nothing is blamed. ``chance`` is what naming states
    at random would reach. Intervals are over recordings that vary together.
    """
    rows: list[dict[str, object]] = []
    known = assessed[(assessed.guilty != "") & assessed.is_disturbed]
    for attribution, prefix in ATTRIBUTIONS.items():
        flagged = known[known[f"{prefix}_1"] != ""]
        for setup, fault, guilty, part in _cells(flagged):
            rng = generator(base_seed, "blame", setup, attribution, fault, guilty)
            resampler = Resampler.draw(
                part.base_seed.astype(str).tolist(), cfg.bootstrap_draws, cfg.confidence, rng
            )
            row: dict[str, object] = {
                "setup": setup,
                "attribution": attribution,
                "fault": fault,
                "guilty": guilty,
                "windows": len(part),
                "recordings": part.recording.nunique(),
            }
            for top in (1, 3):
                row |= _hits(part, prefix, top, resampler)
                row[f"chance_{top}"] = float(np.minimum(1.0, top * part[f"{prefix}_chance"]).mean())
            rows.append(row)
    return pd.DataFrame(rows, columns=list(BLAME_COLUMNS))


def named_by_chance(guilty: str, states: Sequence[str]) -> float:
    """Return how often one state named at random is the guilty one: never, if it is not there."""
    return 1.0 / len(states) if _names(states, guilty) else 0.0


def _cells(flagged: pd.DataFrame) -> Iterator[tuple[str, str, str, pd.DataFrame]]:
    """Yield set-up, fault, guilty channel and windows: all faults, each, and each by channel."""
    for setup, own in flagged.groupby("setup", sort=False):
        yield str(setup), ANY, ANY, own
        for fault, part in own.groupby("fault", sort=True):
            yield str(setup), str(fault), ANY, part
            for guilty, one in part.groupby("guilty", sort=True):
                yield str(setup), str(fault), str(guilty), one


def _hits(part: pd.DataFrame, prefix: str, top: int, resampler: Resampler) -> dict[str, float]:
    named = part[[f"{prefix}_{i}" for i in range(1, top + 1)]].to_numpy(dtype=str)
    hits = np.array([_names(row, guilty) for row, guilty in zip(named, part.guilty, strict=True)])
    both = resampler.totals(np.stack([hits, np.ones(len(hits))], axis=1).astype(np.float64))
    drawn = np.full(len(both), np.nan)
    np.divide(both[:, 0], both[:, 1], out=drawn, where=both[:, 1] > 0)
    low, high = resampler.interval(drawn)
    return {f"hit_{top}": float(hits.mean()), f"hit_{top}_low": low, f"hit_{top}_high": high}


def _names(named: Sequence[str] | NDArray[np.str_], guilty: str) -> bool:
    """Whether the guilty channel is among the named; a heading's z and w are named together."""
    return any(guilty in name.split(" / ") for name in named)
