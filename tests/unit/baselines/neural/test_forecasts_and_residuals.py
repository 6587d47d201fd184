"""What each score is made of."""

import numpy as np
import pytest
import torch

from odisar.baselines.interface import context_positions
from odisar.baselines.neural.gru_twin import GruTwin, fit_gru_twin
from odisar.baselines.neural.learning import reference_windows
from odisar.windows.windowing import Batch

from .neural_cases import BUDGET


@pytest.fixture
def batch(reference) -> Batch:
    return reference_windows(reference)[0].gather(torch.arange(0, 60, 7))


def test_the_gru_twin_has_the_papers_two_losses_and_the_second_moves_the_forecast(reference, batch):
    network = GruTwin(reference.spec, batch.context.shape[2])
    output = network(batch.context)
    forecast_loss = (output.forecast - batch.truth).square().mean()
    reconstruction_loss = (output.reconstruction - output.forecast).square().mean()
    torch.testing.assert_close(network.loss(batch), forecast_loss + reconstruction_loss)
    reconstruction_loss.backward()
    moved = [parameter.grad.abs().max() for parameter in network.forecast_head.parameters()]
    assert min(moved) > 0


def test_a_fitted_gru_twin_forecasts_better_than_the_mean(reference):
    held_out = reference_windows(reference)[1]
    batch = held_out.gather(torch.arange(len(held_out)))
    network = fit_gru_twin(reference, BUDGET)
    with torch.no_grad():
        error = (network(batch.context).forecast - batch.truth).square()
    assert error.mean() < 0.9 * (batch.truth - batch.truth.mean(dim=(0, 1))).square().mean()


@pytest.mark.parametrize("name", ["gru-reconstruction"])
def test_the_score_is_the_root_mean_square_of_reconstruction_minus_forecast(
    detector, reference, batch
):
    recording = reference.train[0]
    first = context_positions(recording, reference.spec)[:60:7]
    network = fit_gru_twin(reference, BUDGET)
    with torch.no_grad():
        output = network(batch.context)
    expected = (output.reconstruction - output.forecast).square().mean(dim=(1, 2)).sqrt()
    scores = detector.score([recording])[0][first]
    np.testing.assert_allclose(scores, expected, rtol=1e-3)


@pytest.mark.parametrize("name", ["input-reconstruction"])
def test_t2_of_held_out_windows_is_the_number_of_features_on_average(detector, reference, batch):
    scores = np.concatenate(detector.score(reference.held_out))
    assert np.nanmean(scores) == pytest.approx(batch.context.shape[2], rel=0.02)


@pytest.mark.parametrize("name", ["rnn-then-autoencoder"])
def test_the_score_is_the_error_of_the_reconstructed_forecast(detector, reference, batch):
    recording = reference.train[0]
    first = context_positions(recording, reference.spec)[:60:7]
    with torch.no_grad():
        forecast = detector._forecaster(batch.context)
        error = detector._autoencoder(forecast) - forecast
    assert forecast.shape == batch.truth.shape
    expected = error.square().mean(dim=(1, 2)).sqrt()
    np.testing.assert_allclose(detector.score([recording])[0][first], expected, rtol=1e-3)
