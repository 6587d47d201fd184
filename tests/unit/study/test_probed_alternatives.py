"""Every alternative is probed; all but the published recipe after a short training."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from odisar.artifacts import Workspace
from odisar.baselines.neural.registry import NOT_DEPLOYABLE
from odisar.config.loader import ConfigView, load_config
from odisar.stages.members import MemberData
from odisar.study import alternatives, leakage
from odisar.windows.scaling import Scaler
from small_bundle import small_case
from small_system import SPEC, make_recording


class Stand:
    """A detector that says what a sample, or the one after it, is."""

    def __init__(self, shift: int) -> None:
        self._shift = shift

    def fit(self, reference):
        self._std = reference.train[0].values[:, 1].std()

    def score(self, recordings):
        return [np.exp(np.roll(item.values[:, 1], -self._shift)) / self._std for item in recordings]


@pytest.fixture
def config(request):
    return ConfigView(load_config(request.config.rootpath), leakage.PARAMS)


@pytest.fixture
def probed(monkeypatch, tmp_path, config):
    """Return the written table, and by share the names of what was made at that size."""
    made: dict[float, list[str]] = {}

    def stands(_config, _twin, share):
        def make(name, shift):
            made.setdefault(share, []).append(name)
            return Stand(shift)

        shifts = {NOT_DEPLOYABLE[0]: 1, "honest": 0}
        return {name: lambda n=name, s=shift: make(n, s) for name, shift in shifts.items()}

    train = [make_recording(f"train-{i}", 100) for i in range(2)]
    splits = {"train": train, "validation": train, "calibration": [make_recording("c", 200)]}
    data = MemberData(small_case(), splits, Scaler.fit(train, SPEC), SPEC)
    monkeypatch.setattr(leakage, "load_member", lambda *_: data)
    monkeypatch.setattr(leakage, "all_alternatives", stands)
    monkeypatch.setattr(leakage, "read_twin", lambda _: None)
    leakage.run(config, Workspace(tmp_path))
    return pd.read_csv(Workspace(tmp_path).study_results / "leakage.csv"), made


def test_all_are_probed_and_the_recipe_comes_last(probed):
    table, _ = probed
    assert list(dict.fromkeys(table.detector)) == ["honest", NOT_DEPLOYABLE[0]]
    moved = table.set_index(["detector", "probe"]).moved
    assert moved["honest", "future"] == 0
    assert moved["honest", "control"] > 0
    assert moved[NOT_DEPLOYABLE[0], "future"] > 0


def test_only_the_recipe_is_trained_whole(probed):
    _, made = probed
    assert made == {0.1: ["honest"], 1.0: [NOT_DEPLOYABLE[0]]}


def test_a_share_is_one_of_the_steps(monkeypatch, config, trained_twin):
    budgets = []
    monkeypatch.setattr(
        alternatives, "neural_detectors", lambda budget: budgets.append(budget) or {}
    )
    alternatives.all_alternatives(config, trained_twin, share=0.1)
    alternatives.all_alternatives(config, trained_twin)
    assert [budget.steps for budget in budgets] == [
        round(0.1 * config.study.detectors.steps),
        config.study.detectors.steps,
    ]


def test_draws_of_a_twin_that_must_know_commands_are_no_alternative(config, trained_twin):
    names = alternatives.all_alternatives(config, trained_twin)
    assert alternatives.DROPOUT_VARIANCE in names
    knowing = replace(trained_twin, spec=replace(SPEC, known_ahead=(0,)))
    assert alternatives.DROPOUT_VARIANCE not in alternatives.all_alternatives(config, knowing)
