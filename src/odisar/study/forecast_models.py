"""The forecasters of the study by name, and trainings of the twin as forecasters among them."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch

from odisar.config.loader import ConfigView
from odisar.config.study import FitConfig
from odisar.fitting import FitBudget
from odisar.forecasters.gru import GruForecaster, GruSize
from odisar.forecasters.interface import Forecaster
from odisar.forecasters.pilot import (
    GanForecaster,
    GenerativeSize,
    RnnForecaster,
    RnnSize,
    VaeForecaster,
)
from odisar.forecasters.published_mixer import MixerForecaster, MixerSize
from odisar.forecasters.registry import cheap_forecasters
from odisar.seeding import derive_seed
from odisar.stages.members import MemberData
from odisar.twin.plan import TrainingPlan
from odisar.twin.training import train_twin
from odisar.windows.window_set import WindowSet

#: Epochs into which a twin's share of the budget is divided.
_EPOCHS = 6


@dataclass(frozen=True)
class TwinForm:
    """A twin that is compared as a forecaster: changes of its configuration and training."""

    twin: dict[str, Any]
    training: dict[str, Any]


#: ``paper``: its table of parameters, one step a token, plain errors. ``plain``: ours in all but
#: the loss. ``weighed``: the default. ``residual``: the horizon too stands on a closed form.
TWINS = {
    "paper-transformer": TwinForm(
        {"patch_steps": 1, "residual_forecast": False},
        {"weigh_loss": False, "learning_rate": 1.0e-4},
    ),
    "transformer": TwinForm({"residual_forecast": False}, {"weigh_loss": False}),
    "weighed-transformer": TwinForm({"residual_forecast": False}, {"weigh_loss": True}),
    "residual-transformer": TwinForm({"residual_forecast": True}, {"weigh_loss": True}),
}


class TwinForecaster:
    """A twin trained as the pipeline does, with a share of its windows."""

    def __init__(self, form: TwinForm, plan: TrainingPlan, scratch: Path, name: str) -> None:
        self._plan = replace(
            plan,
            twin=plan.twin.model_copy(update=form.twin),
            training=plan.training.model_copy(update=form.training),
        )
        self._scratch, self._name = scratch, name
        self.cpu_s = 0.0
        self.history: list[dict[str, float]] = []
        self._network: Callable[..., Any] | None = None

    def fit(self, train: WindowSet, validation: WindowSet) -> None:
        """Train, from the start: the time of a resumed training says nothing."""
        before_s = time.process_time()
        trained = train_twin(self._plan, train, validation, self._scratch, name=self._name)
        self.cpu_s = time.process_time() - before_s
        self.history, self._network = trained.history, trained.network

    @torch.inference_mode()
    def forecast(self, context: torch.Tensor, known_future: torch.Tensor) -> torch.Tensor:
        """Return (window, horizon step, state), scaled."""
        assert self._network is not None  # noqa: S101 (fitted before)
        forecast: torch.Tensor = self._network(context, known_future).forecast
        return forecast


def twin_forecaster(name: str, plan: TrainingPlan, fit: FitConfig, scratch: Path) -> TwinForecaster:
    """Return a twin that sees as many windows as the other forecasters, in batches of its own."""
    windows = fit.steps * fit.batch_size
    steps = max(1, windows // (plan.training.batch_size * _EPOCHS))
    # A rate that suits a short training; the form may have its own.
    budget = {
        "epochs": _EPOCHS,
        "patience_epochs": _EPOCHS,
        "steps_per_epoch": steps,
        "learning_rate": fit.learning_rate / 2,
    }
    form = TWINS[name]
    return TwinForecaster(TwinForm(form.twin, budget | form.training), plan, scratch, name)


def simple_forecasters(
    config: ConfigView, data: MemberData, fit: FitConfig
) -> dict[str, Callable[[], Forecaster]]:
    """Return what makes each forecaster that is no twin, by name; ``data.spec`` says the rest."""
    budget, seed = FitBudget(**fit.model_dump()), derive_seed(config.seed, "forecasters")
    mixer = MixerSize(config.twin.patch_steps, 32, 3, 0.1)
    return cheap_forecasters(data.scaler, data.spec, data.case.rate_hz) | {
        "gru": lambda: GruForecaster(GruSize(64, 128), budget, seed),
        "patch-ts-mixer": lambda: MixerForecaster(mixer, budget, seed),
    }


def pilot_forecasters(config: ConfigView, fit: FitConfig) -> dict[str, Callable[[], Forecaster]]:
    """Return what makes each model of the paper's pilot study but the Transformer, by name."""
    budget, seed = FitBudget(**fit.model_dump()), derive_seed(config.seed, "forecasters")
    return {
        "rnn": lambda: RnnForecaster(RnnSize(64), budget, seed),
        "vae": lambda: VaeForecaster(GenerativeSize(128, 16, 0.01), budget, seed),
        "gan": lambda: GanForecaster(GenerativeSize(128, 16, 0.01), budget, seed),
    }
