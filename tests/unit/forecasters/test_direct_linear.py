from dataclasses import replace

import numpy as np
import pytest
import torch

from odisar.errors import OdisarError
from odisar.forecasters.direct_linear import DirectDesign, DirectLinear
from odisar.forecasters.interface import WindowShape
from odisar.forecasters.moments import Moments
from odisar.forecasters.persistence import Persistence
from odisar.recordings.schema import Recording, RecordingInfo
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from small_system import SPEC, make_recording

PENALTIES = (1e-8, 1e-4, 1.0)
TRAIN = [make_recording(f"train-{i}") for i in range(6)]
SCALER = Scaler.fit(TRAIN, SPEC)


def fitted(train, validation, lags=(1, 5, 20), penalties=PENALTIES, scaler=SCALER) -> DirectLinear:
    forecaster = DirectLinear(scaler, train.spec, lags, penalties)
    forecaster.fit(train, validation)
    return forecaster


def every_window(windows: WindowSet):
    return windows.gather(torch.arange(len(windows)))


def mse(forecast, windows: WindowSet) -> float:
    batch = every_window(windows)
    error = forecast(batch.context, batch.known_future) - batch.truth
    return float((error**2).mean())


def known_windows() -> tuple[WindowSet, WindowSet]:
    spec = replace(SPEC, known_ahead=(0,))
    validation = [make_recording(f"validation-{i}") for i in range(2)]
    return WindowSet(TRAIN, SCALER, spec), WindowSet(validation, SCALER, spec, stride_steps=10)


def test_the_design_holds_constant_products_known_commands_and_the_newest_lag_first():
    context = torch.tensor([[[1.0, 2.0], [3.0, 5.0]]])
    known = torch.tensor([[[7.0], [8.0]]])
    design = DirectDesign(2)
    assert design(context, known).tolist() == [[1, 9, 15, 25, 7, 8, 3, 5, 1, 2]]
    assert design.width(WindowShape(2, 2, 2, 1, 1)) == 10


def test_fewer_lags_are_the_first_columns_of_more():
    context, known = torch.randn(4, 9, 3), torch.randn(4, 5, 1)
    few = DirectDesign(3)(context, known)
    torch.testing.assert_close(DirectDesign(9)(context, known)[:, : few.shape[1]], few)


def test_the_moments_give_the_textbook_ridge_and_its_error(windows):
    train, validation = windows
    design = DirectDesign(2)

    def columns(batch):
        return design(batch.context.double(), batch.known_future.double())

    weights = Moments.of(train, columns).ridge(0.01, np.zeros((13, 20)))
    batch = every_window(train)
    x, y = columns(batch).numpy(), batch.truth.flatten(1).double().numpy()
    penalty = 0.01 * len(x) * np.eye(x.shape[1])
    penalty[0, 0] = 0
    np.testing.assert_allclose(weights, np.linalg.solve(x.T @ x + penalty, x.T @ y), atol=1e-9)
    other = every_window(validation)
    missed = columns(other).numpy() @ weights - other.truth.flatten(1).double().numpy()
    errors = Moments.of(validation, columns).squared_errors(weights)
    np.testing.assert_allclose(errors, np.mean(missed**2, axis=0), rtol=1e-6)


def test_a_linear_system_is_forecast_exactly():
    random = np.random.default_rng(0)
    states = np.zeros((400, 2))
    states[0] = 1.0, 0.5
    turn = np.array([[0.96, -0.25], [0.25, 0.96]])
    for i in range(1, 400):
        states[i] = turn @ states[i - 1]
    values = np.column_stack([random.normal(size=400), states])
    recording = Recording("linear", RecordingInfo("linear"), np.arange(400.0), values)
    scaler = Scaler.fit([recording], SPEC)
    windows = WindowSet([recording], scaler, SPEC)
    assert mse(fitted(windows, windows, scaler=scaler).forecast, windows) < 1e-6


def test_a_square_in_the_system_is_found_from_the_last_sample():
    random = np.random.default_rng(1)
    drive = random.normal(size=2000)
    answer = np.concatenate([[0.0], drive[:-1] ** 2])
    values = np.column_stack([drive, answer, random.normal(size=2000)])
    recording = Recording("square", RecordingInfo("square"), np.arange(2000.0), values)
    spec = replace(SPEC, outputs=(1,))
    scaler = Scaler.fit([recording], spec)
    windows = WindowSet([recording], scaler, spec)
    forecaster = fitted(windows, windows, lags=(1,), scaler=scaler)
    batch = every_window(windows)
    error = forecaster.forecast(batch.context, batch.known_future) - batch.truth
    by_step = (error**2).mean(dim=(0, 2))
    assert by_step[0] < 1e-6
    assert by_step[1] > 0.5


def test_it_beats_persistence_and_knowing_the_command_helps(windows):
    known = known_windows()
    train, validation = windows
    held = Persistence(SCALER, SPEC)
    linear = mse(fitted(train, validation).forecast, validation)
    assert linear < 0.6 * mse(held.forecast, validation)
    assert mse(fitted(*known).forecast, known[1]) < 0.5 * linear


def test_a_penalty_without_end_is_persistence(windows):
    train, validation = windows
    forecaster = fitted(train, validation, penalties=(1e12,))
    batch = every_window(validation)
    held = Persistence(SCALER, SPEC)
    shift = forecaster.forecast(batch.context, batch.known_future) - held.forecast(
        batch.context, batch.known_future
    )
    # The constant is free: it may move every window alike, and no window apart.
    assert float(shift.std(dim=0).max()) < 1e-4


def test_the_choice_has_the_least_validation_error_of_all(windows):
    train, validation = windows
    chosen = mse(fitted(train, validation).forecast, validation)
    for lags in (1, 5, 20):
        for penalty in PENALTIES:
            single = fitted(train, validation, (lags,), (penalty,))
            assert chosen <= mse(single.forecast, validation) + 1e-5


def test_the_fitted_arrays_are_the_forecast(windows):
    train, validation = windows
    forecaster = fitted(train, validation)
    batch = every_window(validation)
    design = forecaster.fitted.design(batch.context, batch.known_future)
    flat = design.numpy() @ forecaster.fitted.weights.numpy()
    found = forecaster.forecast(batch.context, batch.known_future).flatten(1).numpy()
    np.testing.assert_allclose(flat, found, atol=1e-5)


def test_lags_beyond_the_context_and_an_unfitted_forecast_are_refused():
    with pytest.raises(OdisarError, match="all longer than the context of 20 steps"):
        DirectLinear(SCALER, SPEC, (30,), PENALTIES)
    with pytest.raises(OdisarError, match="call fit first"):
        _ = DirectLinear(SCALER, SPEC, (5,), PENALTIES).fitted
