"""How much structure a closed-form model leaves: what trees can still say about its residuals.

A linear model's one-step residual is noise if the model is right. Gradient-boosted trees (Friedman
2001, Annals of Statistics) fitted to the residual, given what the model saw, find the smooth and
the stepped nonlinearities it missed; the share of variance they explain on other recordings is a
lower bound of what a network could gain.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingRegressor

from odisar.config.judging import EvaluationConfig
from odisar.errors import OdisarError
from odisar.evaluation.intervals import Resampler
from odisar.seeding import derive_seed, generator

NONLINEARITY_COLUMNS = (
    "setup",
    "state",
    "explained",
    "ci_low",
    "ci_high",
    "trees",
    "rows",
    "clusters",
)

FloatArray = NDArray[np.float64]

# Every fourth recording decides how many trees are enough: rows of the recordings that grow the
# trees resemble one another too much to decide it.
_STOPPING_SHARE = 4


@dataclass(frozen=True)
class Residuals:
    """What a model leaves: ``design`` (row, column) it saw, ``residual`` (row, state) it left.

    ``clusters`` (row,) are the recordings, or groups of them that vary together.
    """

    design: FloatArray
    residual: FloatArray
    clusters: NDArray[np.str_]


@dataclass(frozen=True)
class TreePlan:
    """How trees are grown: at most ``rows`` training rows, drawn by seed, and ``trees`` a state."""

    rows: int
    trees: int
    learning_rate: float
    leaves: int
    rows_per_leaf: int


def nonlinearity_table(
    setup: str,
    parts: tuple[Residuals, Residuals],
    states: Sequence[str],
    plan: TreePlan,
    cfg: EvaluationConfig,
    base_seed: int,
) -> pd.DataFrame:
    """Return ``NONLINEARITY_COLUMNS``: for each state, the share of residual variance explained.

    ``parts`` are the residuals on training recordings, from which trees are grown, and on
    validation recordings, on which they are judged: 1 - sum of squares left / sum of squares about
    the training mean. Zero or less says that the trees found nothing that holds; intervals are
    over recordings. Raises OdisarError with fewer than two training recordings.
    """
    train, validation = parts
    grow, stop = _divided(train, plan, derive_seed(base_seed, "nonlinearity", setup, "rows"))
    rng = generator(base_seed, "nonlinearity", setup, "bootstrap")
    resampler = Resampler.draw(
        validation.clusters.tolist(), cfg.bootstrap_draws, cfg.confidence, rng
    )
    rows = []
    for state, name in enumerate(states):
        trees = _grow(grow, stop, state, plan)
        before = validation.residual[:, state] - grow.residual[:, state].mean()
        after = validation.residual[:, state] - trees.predict(validation.design)
        squares = np.column_stack([before**2, after**2])
        drawn = resampler.totals(squares)
        low, high = resampler.interval(1.0 - drawn[:, 1] / drawn[:, 0])
        total = squares.sum(axis=0)
        rows.append(
            {
                "setup": setup,
                "state": name,
                "explained": 1.0 - total[1] / total[0],
                "ci_low": low,
                "ci_high": high,
                "trees": trees.n_iter_,
                "rows": len(grow.residual) + len(stop.residual),
                "clusters": len(np.unique(validation.clusters)),
            }
        )
    return pd.DataFrame(rows, columns=list(NONLINEARITY_COLUMNS))


def _grow(
    grow: Residuals, stop: Residuals, state: int, plan: TreePlan
) -> HistGradientBoostingRegressor:
    trees = HistGradientBoostingRegressor(
        learning_rate=plan.learning_rate,
        max_iter=plan.trees,
        max_leaf_nodes=plan.leaves,
        min_samples_leaf=plan.rows_per_leaf,
        early_stopping=True,
        random_state=0,
    )
    return trees.fit(
        grow.design,
        grow.residual[:, state],
        X_val=stop.design,
        y_val=stop.residual[:, state],
    )


def _divided(train: Residuals, plan: TreePlan, seed: int) -> tuple[Residuals, Residuals]:
    """Return at most ``plan.rows`` rows: those that grow trees, and those that stop them."""
    random = np.random.default_rng(seed)
    names = random.permutation(np.unique(train.clusters))
    if len(names) < 2:
        raise OdisarError(
            f"residuals of {len(names)} training recording(s) can't both grow trees and say when "
            "to stop; give two or more"
        )
    count = min(plan.rows, len(train.residual))
    chosen = np.sort(random.choice(len(train.residual), count, replace=False))
    stopping = np.isin(train.clusters[chosen], names[::_STOPPING_SHARE])
    return _rows(train, chosen[~stopping]), _rows(train, chosen[stopping])


def _rows(part: Residuals, rows: NDArray[np.intp]) -> Residuals:
    return Residuals(part.design[rows], part.residual[rows], part.clusters[rows])
