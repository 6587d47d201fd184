import numpy as np
import pytest

from odisar.errors import OdisarError
from odisar.evaluation.nonlinearity import (
    NONLINEARITY_COLUMNS,
    Residuals,
    TreePlan,
    nonlinearity_table,
)

from .evaluation_cases import CONFIG

PLAN = TreePlan(rows=2000, trees=60, learning_rate=0.1, leaves=15, rows_per_leaf=20)


def residuals(seed: int, clusters: int = 8, rows: int = 300) -> Residuals:
    """Return residuals that are a step of the design and noise alike, and noise alone."""
    random = np.random.default_rng(seed)
    design = random.normal(size=(clusters * rows, 3))
    noise = random.normal(size=(clusters * rows, 2))
    residual = np.column_stack([np.sign(design[:, 1]) + noise[:, 0], noise[:, 1]])
    names = np.repeat([f"recording {i}" for i in range(clusters)], rows)
    return Residuals(design, residual, names)


def table_of(parts, seed=1, plan=PLAN):
    return nonlinearity_table("system", parts, ("stepped", "noise"), plan, CONFIG, seed)


def test_trees_find_the_step_and_nothing_in_noise():
    table = table_of((residuals(1), residuals(2)))
    assert list(table.columns) == list(NONLINEARITY_COLUMNS)
    stepped, noise = table.iloc[0], table.iloc[1]
    assert stepped.explained == pytest.approx(0.5, abs=0.06)
    assert stepped.ci_low < stepped.explained < stepped.ci_high
    assert noise.explained < 0.02
    assert noise.trees < stepped.trees
    assert (stepped.rows, stepped.clusters) == (2000, 8)


def test_the_answer_is_the_same_twice():
    parts = (residuals(1), residuals(2))
    assert table_of(parts).equals(table_of(parts))


def test_what_holds_in_no_other_recording_is_not_explained():
    train, other = residuals(1), residuals(2)
    opposite = Residuals(other.design, -other.residual, other.clusters)
    assert table_of((train, opposite)).iloc[0].explained < -0.5


def test_one_training_recording_cannot_grow_and_stop_trees():
    with pytest.raises(OdisarError, match="1 training recording"):
        table_of((residuals(1, clusters=1), residuals(2)))
