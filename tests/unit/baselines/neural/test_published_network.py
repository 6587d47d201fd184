"""What the published network does and the paper doesn't say, as facts about a network."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from odisar.baselines.neural.published_network import PublishedNetwork
from odisar.errors import OdisarError
from odisar.windows.windowing import Batch, WindowSpec

STEPS = 8
SPEC = WindowSpec(STEPS, STEPS, outputs=(1, 2), commands=(0,), known_ahead=())


@pytest.fixture(scope="module")
def network() -> PublishedNetwork:
    torch.manual_seed(3)
    return PublishedNetwork(SPEC, 3).eval()


@pytest.fixture
def batch() -> Batch:
    random = torch.Generator().manual_seed(4)
    return Batch(
        torch.randn((6, STEPS, 3), generator=random),
        torch.empty(6, STEPS, 0),
        torch.randn((6, STEPS, 2), generator=random),
        torch.randn((6, 3), generator=random),
    )


@torch.no_grad()
def forecast(network: PublishedNetwork, context: torch.Tensor, future: torch.Tensor) -> np.ndarray:
    return network(context, future).forecast.numpy()


def test_the_true_future_alone_moves_the_forecast(network, batch):
    before = forecast(network, batch.context, batch.truth)
    after = forecast(network, batch.context, -batch.truth)
    assert np.abs(after - before).max() > 0.05


def test_a_step_of_the_future_moves_the_forecast_of_that_very_step_and_of_no_other(network, batch):
    changed = batch.truth.clone()
    changed[:, 3] += 1
    moved = np.abs(
        forecast(network, batch.context, changed) - forecast(network, batch.context, batch.truth)
    ).max(axis=(0, 2))
    assert moved[3] > 0.01
    np.testing.assert_array_equal(np.delete(moved, 3), 0)


def test_another_window_of_the_batch_moves_the_forecast(network, batch):
    changed = batch.context.clone()
    changed[1:] += 1
    before = forecast(network, batch.context, batch.truth)[0]
    after = forecast(network, changed, batch.truth)[0]
    assert np.abs(after - before).max() > 0.01


def test_a_window_in_a_batch_and_the_window_alone_differ(network, batch):
    together = forecast(network, batch.context, batch.truth)[:1]
    alone = forecast(network, batch.context[:1], batch.truth[:1])
    assert np.abs(together - alone).max() > 0.01


def test_the_last_step_of_the_forecast_sees_only_the_last_step_of_the_context(network, batch):
    earlier, last = batch.context.clone(), batch.context.clone()
    earlier[:, :-1] += 5
    last[:, -1] += 5
    before = forecast(network, batch.context, batch.truth)[:, -1]
    np.testing.assert_array_equal(forecast(network, earlier, batch.truth)[:, -1], before)
    assert np.abs(forecast(network, last, batch.truth)[:, -1] - before).max() > 0.01


def test_the_forecast_is_detached_in_the_reconstruction_loss(network, batch):
    network.zero_grad()
    network.reconstruction_loss(batch).backward()
    assert network.forecast_head.weight.grad is None
    assert network.reconstruction_head[0].weight.grad.abs().max() > 0
    network.zero_grad()
    network.joint_loss(batch).backward()
    assert network.forecast_head.weight.grad.abs().max() > 0


def test_the_second_phase_moves_the_reconstruction_head_alone():
    network = PublishedNetwork(SPEC, 3)
    network.keep_only_reconstruction_trainable()
    moved = {name.split(".")[0] for name, p in network.named_parameters() if p.requires_grad}
    assert moved == {"reconstruction_head"}


def test_context_and_horizon_of_different_length_are_refused():
    with pytest.raises(OdisarError, match="context_steps=8 must equal horizon_steps=4"):
        PublishedNetwork(replace(SPEC, horizon_steps=4), 3)
