"""Forecasters of the study: one name each, and twins that see no more than the others."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from odisar.config.study import FitConfig
from odisar.study import forecast_models
from odisar.study.forecast_models import (
    TWINS,
    pilot_forecasters,
    simple_forecasters,
    twin_forecaster,
)
from odisar.windows.scaling import Scaler
from small_system import SPEC

CONFIG = SimpleNamespace(
    seed=1,
    twin=SimpleNamespace(patch_steps=5),
    training=SimpleNamespace(gradient_clip=1.0),
)
SCALER = Scaler(np.zeros(3), np.ones(3), np.zeros(2), np.ones(2))
DATA = SimpleNamespace(scaler=SCALER, spec=SPEC, case=SimpleNamespace(rate_hz=1.0))


def fit(steps, batch_size=32):
    """Return how long forecasters are fitted."""
    return FitConfig(
        steps=steps,
        batch_size=batch_size,
        learning_rate=2.0e-3,
        gradient_clip=1.0,
        validations=5,
    )


@pytest.fixture
def trained(monkeypatch):
    """Return what a twin would have been trained with."""
    found = []

    def train(plan, train, validation, scratch, *, name):
        found.append((plan, train, validation, scratch, name))
        network = lambda context, known: SimpleNamespace(forecast=context + known)  # noqa: E731
        return SimpleNamespace(network=network, history=[{"epoch": 0.0}])

    monkeypatch.setattr(forecast_models, "train_twin", train)
    return found


def plan_of(name, plan, budget, trained, folder):
    """Return the plan that a twin of this name is trained by."""
    twin_forecaster(name, plan, budget, folder).fit("train", "validation")
    return trained[-1][0]


def test_every_forecaster_has_a_name_of_its_own():
    simple = simple_forecasters(CONFIG, DATA, fit(10))
    pilot = pilot_forecasters(CONFIG, fit(10))
    assert list(simple) == [
        "persistence",
        "constant-velocity",
        "closed-form",
        "gru",
        "patch-ts-mixer",
    ]
    assert list(pilot) == ["rnn", "vae", "gan"]
    assert list(TWINS) == [
        "paper-transformer",
        "transformer",
        "weighed-transformer",
        "residual-transformer",
    ]


def test_a_forecaster_is_made_anew_each_time_and_can_be_fitted_and_asked():
    made = simple_forecasters(CONFIG, DATA, fit(10)) | pilot_forecasters(CONFIG, fit(10))
    for make in made.values():
        first, second = make(), make()
        assert first is not second
        assert callable(first.fit)
        assert callable(first.forecast)
    kinds = {name: type(make()) for name, make in made.items()}
    assert len(set(kinds.values())) == len(kinds)


@pytest.mark.parametrize("name", TWINS)
def test_a_twin_sees_as_many_windows_as_the_others(name, plan, trained, tmp_path):
    training = plan_of(name, plan, fit(60), trained, tmp_path).training
    assert training.batch_size == plan.training.batch_size
    assert training.epochs * training.steps_per_epoch * training.batch_size == 60 * 32
    # It is never stopped before it has seen them.
    assert training.patience_epochs == training.epochs


@pytest.mark.parametrize("steps", [7, 61, 100])
def test_windows_that_do_not_divide_leave_less_than_a_step_of_each_epoch(
    steps, plan, trained, tmp_path
):
    training = plan_of("transformer", plan, fit(steps), trained, tmp_path).training
    of_a_step = training.epochs * training.batch_size
    left = steps * 32 - of_a_step * training.steps_per_epoch
    assert 0 <= left < of_a_step


def test_the_smallest_budget_is_still_a_step(plan, trained, tmp_path):
    training = plan_of("transformer", plan, fit(1, batch_size=1), trained, tmp_path).training
    assert training.steps_per_epoch == 1


def test_a_form_changes_what_it_says_and_nothing_else(plan, trained, tmp_path):
    paper, plain, weighed, residual = (
        plan_of(name, plan, fit(60), trained, tmp_path) for name in TWINS
    )
    assert paper.twin == plan.twin.model_copy(update={"patch_steps": 1})
    assert paper.training.learning_rate == 1.0e-4
    assert not paper.training.weigh_loss
    assert plain.twin == weighed.twin == plan.twin
    assert plain.training == weighed.training.model_copy(update={"weigh_loss": False})
    assert weighed.training.learning_rate == 2.0e-3 / 2
    assert weighed.training.weigh_loss
    assert residual.twin == plan.twin.model_copy(update={"residual_forecast": True})
    assert residual.training == weighed.training
    assert {one.seed for one in (paper, plain, weighed, residual)} == {plan.seed}


def test_a_fitted_twin_forecasts_with_its_network_and_remembers_its_training(
    plan, trained, tmp_path
):
    forecaster = twin_forecaster("transformer", plan, fit(60), tmp_path)
    forecaster.fit("train", "validation")
    assert trained[0][1:] == ("train", "validation", tmp_path, "transformer")
    assert forecaster.history == [{"epoch": 0.0}]
    assert forecaster.cpu_s >= 0
    forecast = forecaster.forecast(torch.tensor([1.0]), torch.tensor([2.0]))
    assert forecast.tolist() == [3.0]
