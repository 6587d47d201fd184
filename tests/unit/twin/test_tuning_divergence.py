"""A diverged trial is a result, or a search over too high learning rates would never end."""

import math

import pytest

from odisar.config.learning import LearningRateRange, TuningConfig
from odisar.errors import OdisarError
from odisar.twin.lightning_module import TwinModule
from odisar.twin.tuning import tune_twin

TUNING = TuningConfig(
    trials=3,
    steps_per_trial=4,
    reports_per_trial=1,
    pruner_warmup_trials=5,
    learning_rate=LearningRateRange(low=1.0e-4, high=1.0e-2),
    model_dim=[8, 16],
    layers=[1],
    feedforward_dim=[32],
    storage="journal",
)


class Begun:
    """How many trials have begun, and which of them meet a loss that is no number."""

    def __init__(self) -> None:
        self.trials = 0
        self.diverging: tuple[int, ...] = ()


@pytest.fixture
def begun(monkeypatch) -> Begun:
    """Watch the trials; stop a search that goes on although enough have finished."""
    count = Begun()
    step, start = TwinModule.training_step, TwinModule.on_train_start

    def on_train_start(module):
        count.trials += 1
        if count.trials > 3 * TUNING.trials:
            pytest.fail("the search goes on for ever")
        start(module)

    def training_step(module, *arguments):
        factor = math.nan if count.trials - 1 in count.diverging else 1.0
        return step(module, *arguments) * factor

    monkeypatch.setattr(TwinModule, "on_train_start", on_train_start)
    monkeypatch.setattr(TwinModule, "training_step", training_step)
    return count


def test_a_diverging_trial_counts_as_finished_and_is_never_the_best(plan, windows, tmp_path, begun):
    begun.diverging = (0,)
    result = tune_twin(plan, TUNING, windows, str(tmp_path / "s.journal"), "s")
    assert begun.trials == len(result.trials) == TUNING.trials
    assert [row["state"] for row in result.trials] == ["pruned", "complete", "complete"]
    errors = [row["validation_loss"] for row in result.trials[1:]]
    assert result.best_validation_loss == min(errors)
    assert math.isfinite(result.best_validation_loss)


def test_a_search_in_which_every_trial_diverges_ends_with_the_way_out(
    plan, windows, tmp_path, begun
):
    begun.diverging = tuple(range(99))
    with pytest.raises(OdisarError, match=r"every trial diverged.*learning_rate"):
        tune_twin(plan, TUNING, windows, str(tmp_path / "s.journal"), "s")
    assert begun.trials == TUNING.trials
