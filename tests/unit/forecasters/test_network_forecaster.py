from dataclasses import replace

import pytest
import torch
from torch import nn

from odisar.errors import OdisarError
from odisar.fitting import FitBudget
from odisar.forecasters.gru import GruForecaster, GruSize
from odisar.forecasters.interface import fit_timed
from odisar.forecasters.network_forecaster import NetworkForecaster, mean_squared_error
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from small_system import SPEC, make_recording

BUDGET = FitBudget(steps=40, batch_size=16, learning_rate=1e-2, gradient_clip=1.0, validations=4)
SEED = 5


class Constant(nn.Module):
    """Forecasts one learned number, whatever it sees."""

    def __init__(self) -> None:
        super().__init__()
        self.value = nn.Parameter(torch.zeros(1))

    def forward(self, context: torch.Tensor, _known: torch.Tensor) -> torch.Tensor:
        return self.value.expand(len(context), SPEC.horizon_steps, len(SPEC.outputs))


class AwayFromTruth(NetworkForecaster):
    """Minimises something that drives the forecast further and further off."""

    def build(self, _shape):
        return Constant()

    def objective(self, _shape):
        return lambda network, _batch: -network.value.sum()


def test_it_is_judged_by_the_squared_error_whatever_it_minimises(windows):
    forecaster = AwayFromTruth(replace(BUDGET, learning_rate=0.1), SEED)
    forecaster.fit(*windows)
    errors = forecaster.record.validation_errors
    assert list(errors) == [10, 20, 30, 40]
    assert list(errors.values()) == sorted(errors.values())
    assert forecaster.record.best_step == 10
    batch = windows[1].gather(torch.arange(len(windows[1])))
    kept = mean_squared_error(forecaster.network, batch).item()
    assert kept == pytest.approx(errors[10], rel=1e-6)


def test_a_fit_without_training_or_validation_windows_is_refused(windows):
    spec = windows[0].spec
    short = [make_recording("short", spec.context_steps)]
    nothing = WindowSet(short, Scaler.fit(short, spec), spec)
    forecaster = GruForecaster(GruSize(4, 4), BUDGET, SEED)
    with pytest.raises(OdisarError, match=r"no training recording holds a window of 20 \+ 10"):
        forecaster.fit(nothing, windows[1])
    with pytest.raises(OdisarError, match="no validation recording"):
        forecaster.fit(windows[0], nothing)


def test_an_unfitted_network_is_refused_and_a_fitted_one_tells_its_cost(windows):
    forecaster = GruForecaster(GruSize(4, 4), replace(BUDGET, steps=4), SEED)
    with pytest.raises(OdisarError, match="GruForecaster is not fitted yet"):
        _ = forecaster.record
    batch = windows[1].gather(torch.arange(2))
    with pytest.raises(OdisarError, match="GruForecaster is not fitted yet"):
        forecaster.forecast(batch.context, batch.known_future)
    assert fit_timed(forecaster, *windows) >= forecaster.record.cpu_s > 0
