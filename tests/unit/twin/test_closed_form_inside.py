"""The Transformer adds to a frozen closed form, token by token, and knows no later sample."""

import dataclasses

import pytest
import torch

from odisar.twin.lightning_module import TwinModule
from odisar.twin.training import build_module
from odisar.twin.transformer import TwinTransformer
from small_system import SPEC

KNOWN = torch.empty(8, 10, 0)


@pytest.fixture(scope="module")
def batch(windows):
    """Return eight windows of the small system."""
    return windows[0].gather(torch.arange(0, 800, 100))


@pytest.fixture
def fresh(plan, windows):
    """Return a network with fitted closed forms that nothing has trained."""

    def build(**changes):
        torch.manual_seed(1)
        config = plan.twin.model_copy(update=changes)
        network = TwinTransformer(config, SPEC, 3).eval()
        network.fit_closed_forms(windows[0])
        return network

    return build


def moved(network: TwinTransformer) -> TwinTransformer:
    """Return the network with weights that no head begins with."""
    with torch.no_grad():
        for number, weight in enumerate(network.parameters()):
            ramp = torch.arange(weight.numel(), dtype=torch.float32)
            weight.add_((0.1 * torch.cos(0.7 * ramp + number)).view_as(weight))
    return network


def horizon_form(network: TwinTransformer, context: torch.Tensor) -> torch.Tensor:
    return network.horizon_closed_form(context).view(len(context), 10, 2)


@pytest.mark.parametrize("residual", [True, False])
def test_a_fresh_network_says_of_the_next_sample_what_its_closed_form_says(fresh, batch, residual):
    network = fresh(residual_forecast=residual)
    said = network(batch.context, KNOWN).next_sample
    assert said.shape == (8, 2)
    torch.testing.assert_close(said, network.next_closed_form(batch.context))
    assert not torch.allclose(moved(network)(batch.context, KNOWN).next_sample, said, atol=1e-3)


def test_a_fresh_forecast_is_the_closed_form_of_the_horizon_where_that_is_asked_for(fresh, batch):
    network = fresh(residual_forecast=True)
    output = network(batch.context, KNOWN)
    torch.testing.assert_close(output.forecast, horizon_form(network, batch.context))
    published = fresh(residual_forecast=False)
    closed = horizon_form(published, batch.context)
    assert (published(batch.context, KNOWN).forecast - closed).abs().max() > 0.1


def test_what_the_heads_add_is_in_units_of_what_the_closed_form_leaves(fresh, batch):
    network = moved(fresh(residual_forecast=True))
    closed, spread = horizon_form(network, batch.context), network.horizon_spread.clone()
    before = network(batch.context, KNOWN)
    added = [(part - closed) / spread for part in (before.forecast, before.reconstruction)]
    network.horizon_closed_form.spread.mul_(3.0)
    after = network(batch.context, KNOWN)
    torch.testing.assert_close(after.forecast, closed + 3 * spread * added[0])
    torch.testing.assert_close(after.reconstruction, closed + 3 * spread * added[1])
    following = network.next_closed_form(batch.context)
    network.next_closed_form.spread.mul_(2.0)
    torch.testing.assert_close(
        network(batch.context, KNOWN).next_sample, 2 * after.next_sample - following
    )


@pytest.mark.parametrize("patch_steps", [1, 5])
def test_an_encoder_token_knows_nothing_after_its_end(fresh, batch, patch_steps):
    network = moved(fresh(patch_steps=patch_steps))
    tokens = 20 // patch_steps
    before = network.encode(batch.context)
    for token in range(tokens - 1):
        changed = batch.context.clone()
        changed[:, (token + 1) * patch_steps :] += 5.0
        after = network.encode(changed)
        assert torch.equal(after[:, : token + 1], before[:, : token + 1])
        assert (after[:, token + 1 :] - before[:, token + 1 :]).abs().amax(dim=(0, 2)).min() > 1e-3


def test_a_forecast_of_the_sample_after_a_token_knows_nothing_after_the_token(fresh, batch):
    network = moved(fresh())
    before = network.following_samples(network.encode(batch.context), batch.context)
    for token in range(3):
        changed = batch.context.clone()
        changed[:, (token + 1) * 5 :] += 5.0
        after = network.following_samples(network.encode(changed), changed)
        assert torch.equal(after[:, : token + 1], before[:, : token + 1])
        assert not torch.allclose(after[:, token + 1], before[:, token + 1], atol=1e-3)


def test_the_sample_after_the_last_token_is_the_next_one(fresh, batch):
    network = moved(fresh())
    following = network.following_samples(network.encode(batch.context), batch.context)
    torch.testing.assert_close(following[:, -1], network(batch.context, KNOWN).next_sample)


@pytest.mark.parametrize(("lags", "ends"), [(5, [5, 10, 15, 20]), (6, [10, 15, 20]), (20, [20])])
def test_only_tokens_with_the_closed_forms_samples_behind_them_forecast(fresh, batch, lags, ends):
    network = fresh(closed_form_lags=lags)
    assert network.token_ends == ends
    memory = network.encode(batch.context)[:, -len(ends) :]
    following = network.following_samples(memory, batch.context)
    assert following.shape == (8, len(ends), 2)
    for place, end in enumerate(ends):
        closed = network.next_closed_form(batch.context[:, end - lags : end])
        torch.testing.assert_close(following[:, place], closed)


def test_training_leaves_the_closed_forms_as_they_were_fitted(fresh, trained_twin):
    for name in ("next_closed_form", "horizon_closed_form"):
        fitted, kept = getattr(fresh(), name), getattr(trained_twin.network, name)
        assert torch.equal(kept.weights, fitted.weights)
        assert torch.equal(kept.spread, fitted.spread)


def losses_of(plan, windows, batch, monkeypatch, *, weigh):
    """Return the network, the training loss, and what training and validation log."""
    training = plan.training.model_copy(update={"weigh_loss": weigh})
    module = build_module(dataclasses.replace(plan, training=training), windows[0]).eval()
    moved(module.network)
    logged = {}
    monkeypatch.setattr(
        TwinModule, "_log", lambda _, split, losses, __: logged.setdefault(split, losses)
    )
    loss = module.training_step(batch, 0)
    module.validation_step(batch, 0)
    return module.network, loss, logged


@pytest.mark.parametrize("weigh", [True, False])
def test_losses_of_the_horizon_are_in_the_units_that_are_asked_for(
    plan, windows, batch, monkeypatch, weigh
):
    network, loss, logged = losses_of(plan, windows, batch, monkeypatch, weigh=weigh)
    output = network(batch.context, KNOWN)
    unit = network.horizon_spread if weigh else torch.ones(())
    forecast = ((output.forecast - batch.truth) / unit).square().mean()
    rebuilt = ((output.reconstruction - output.forecast) / unit).square().mean()
    torch.testing.assert_close(logged["train"]["forecast_mse"], forecast)
    torch.testing.assert_close(logged["train"]["reconstruction_mse"], rebuilt)
    torch.testing.assert_close(loss, forecast + rebuilt + logged["train"]["next_mse"])
    validation = logged["validation"]
    torch.testing.assert_close(validation["loss"], forecast + validation["next_mse"])
    plain = (output.forecast - batch.truth).square().mean()
    torch.testing.assert_close(validation["forecast_mse"], plain)


@pytest.mark.parametrize("weigh", [True, False])
def test_the_next_samples_loss_is_in_units_of_what_the_closed_form_leaves(
    plan, windows, batch, monkeypatch, weigh
):
    network, _, logged = losses_of(plan, windows, batch, monkeypatch, weigh=weigh)
    spread = network.next_closed_form.spread
    last = (network(batch.context, KNOWN).next_sample - batch.next_sample[:, [1, 2]]) / spread
    torch.testing.assert_close(logged["validation"]["next_mse"], last.square().mean())
    following = network.following_samples(network.encode(batch.context), batch.context)
    truth = torch.cat([batch.context[:, [5, 10, 15]], batch.next_sample[:, None]], dim=1)[..., 1:]
    of_tokens = ((following - truth) / spread).square().mean()
    torch.testing.assert_close(logged["train"]["next_mse"], of_tokens)
