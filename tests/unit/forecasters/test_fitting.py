from dataclasses import replace

import pytest
import torch
from torch import nn

from odisar.errors import OdisarError
from odisar.forecasters.fitting import (
    FittingPlan,
    fit_network,
    mean_squared_error,
    seeded,
    validation_error,
)
from odisar.forecasters.gru import GruForecaster, GruSize
from odisar.forecasters.interface import fit_timed
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from small_system import SPEC, make_recording

PLAN = FittingPlan(
    steps=40, batch_size=16, learning_rate=1e-2, gradient_clip=1.0, validations=4, seed=5
)


class Constant(nn.Module):
    """Forecasts one learned number, whatever it sees."""

    def __init__(self) -> None:
        super().__init__()
        self.value = nn.Parameter(torch.zeros(1))

    def forward(self, context: torch.Tensor, _known: torch.Tensor) -> torch.Tensor:
        return self.value.expand(len(context), SPEC.horizon_steps, len(SPEC.outputs))


def away_from_truth(network: nn.Module, _batch) -> torch.Tensor:
    """Return a loss that drives the forecast further and further off."""
    return -network.value.sum()


def test_the_validation_error_is_taken_at_even_steps_and_after_the_last(windows):
    record = fit_network(Constant(), mean_squared_error, *windows, PLAN)
    assert list(record.validation_mse) == [10, 20, 30, 40]
    assert record.cpu_s > 0
    more = fit_network(Constant(), mean_squared_error, *windows, replace(PLAN, validations=99))
    assert list(more.validation_mse) == list(range(1, 41))


def test_the_weights_of_the_least_validation_error_are_kept(windows):
    network = Constant()
    record = fit_network(network, away_from_truth, *windows, replace(PLAN, learning_rate=0.1))
    errors = list(record.validation_mse.values())
    assert errors == sorted(errors)
    assert record.best_step == 10
    assert validation_error(network, windows[1]) == pytest.approx(errors[0], rel=1e-6)


def test_the_validation_error_weighs_every_window_alike(windows):
    network = Constant()
    batch = windows[1].gather(torch.arange(len(windows[1])))
    expected = mean_squared_error(network, batch).item()
    assert validation_error(network, windows[1]) == pytest.approx(expected, rel=1e-6)


def test_a_fit_that_diverges_says_so(windows):
    def not_a_number(network: nn.Module, _batch) -> torch.Tensor:
        return network.value.sum() * float("nan")

    with pytest.raises(OdisarError, match=r"after step 10.*lower its learning_rate=0\.01"):
        fit_network(Constant(), not_a_number, *windows, PLAN)


def test_a_fit_leaves_threads_and_random_numbers_as_they_were(windows):
    torch.manual_seed(1)
    expected = torch.rand(3)
    torch.manual_seed(1)
    threads = torch.get_num_threads()
    seen = []

    def objective(network: nn.Module, batch) -> torch.Tensor:
        seen.append(torch.get_num_threads())
        return mean_squared_error(network, batch) + 0 * torch.rand(1).sum()

    fit_network(Constant(), objective, *windows, PLAN)
    assert set(seen) == {1}
    assert torch.get_num_threads() == threads
    assert torch.equal(torch.rand(3), expected)


def test_named_seeds_differ_by_name_and_by_seed():
    drawn = []
    for seed, name in ((1, "weights"), (1, "weights"), (1, "noise"), (2, "weights")):
        with seeded(seed, name):
            drawn.append(torch.rand(2).tolist())
    assert drawn[0] == drawn[1]
    assert len({tuple(item) for item in drawn}) == 3


def test_a_fit_without_training_or_validation_windows_is_refused(windows):
    spec = windows[0].spec
    short = [make_recording("short", spec.context_steps)]
    nothing = WindowSet(short, Scaler.fit(short, spec), spec)
    forecaster = GruForecaster(GruSize(4, 4), PLAN)
    with pytest.raises(OdisarError, match=r"no training recording holds a window of 20 \+ 10"):
        forecaster.fit(nothing, windows[1])
    with pytest.raises(OdisarError, match="no validation recording"):
        forecaster.fit(windows[0], nothing)


def test_an_unfitted_network_is_refused_and_a_fitted_one_tells_its_cost(windows):
    forecaster = GruForecaster(GruSize(4, 4), replace(PLAN, steps=4))
    with pytest.raises(OdisarError, match="GruForecaster is not fitted yet"):
        _ = forecaster.record
    batch = windows[1].gather(torch.arange(2))
    with pytest.raises(OdisarError, match="GruForecaster is not fitted yet"):
        forecaster.forecast(batch.context, batch.known_future)
    assert fit_timed(forecaster, *windows) >= forecaster.record.cpu_s > 0
