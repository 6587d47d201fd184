import pytest
import torch

from odisar.twin.bundle import TrainedTwin
from odisar.twin.layers import Dropout
from odisar.twin.mc_dropout import draw_forecasts, draw_masks, stored_masks
from odisar.twin.transformer import TwinTransformer
from small_system import make_recording


def batch(twin: TrainedTwin, windows: int) -> tuple[torch.Tensor, torch.Tensor]:
    samples = torch.from_numpy(twin.scaler.scale(make_recording("mc").values))
    context = torch.stack([samples[i : i + 20] for i in range(windows)])
    return context, torch.empty(windows, 10, 0)


def sites(network: TwinTransformer) -> list[Dropout]:
    return [part for part in network.modules() if isinstance(part, Dropout)]


@pytest.mark.parametrize("scope", ["all", "decoder"])
def test_draws_of_a_window_do_not_depend_on_its_batch(trained_twin, scope):
    masks = draw_masks(trained_twin.network, 6, scope, 3)
    context, known = batch(trained_twin, 5)
    together = draw_forecasts(trained_twin.network, masks, context, known).forecast
    alone = draw_forecasts(trained_twin.network, masks, context[2:3], known[2:3]).forecast
    assert together.shape == (6, 5, 10, 2)
    torch.testing.assert_close(alone[:, 0], together[:, 2], atol=1e-6, rtol=1e-5)


def test_a_draw_is_the_network_with_that_mask_alone(trained_twin):
    context, known = batch(trained_twin, 3)
    all_draws = draw_forecasts(trained_twin.network, trained_twin.masks, context, known).forecast
    third = {name: mask[2:3] for name, mask in trained_twin.masks.items()}
    with stored_masks(trained_twin.network, third), torch.inference_mode():
        one = trained_twin.network(context, known).forecast
    torch.testing.assert_close(one, all_draws[2], atol=1e-6, rtol=1e-5)


def test_draws_differ_and_repeat(trained_twin):
    context, known = batch(trained_twin, 2)
    first = draw_forecasts(trained_twin.network, trained_twin.masks, context, known).forecast
    again = draw_forecasts(trained_twin.network, trained_twin.masks, context, known).forecast
    assert torch.equal(first, again)
    assert first.std(dim=0).min() > 0


@pytest.mark.parametrize("training", [True, False])
def test_the_module_is_left_as_it_was_found(trained_twin, training):
    network = trained_twin.network.train(training)
    try:
        with stored_masks(network, trained_twin.masks):
            assert all(site.masks is not None for site in sites(network))
        with pytest.raises(ZeroDivisionError), stored_masks(network, trained_twin.masks):
            _ = 1 / 0
        assert network.training is training
        assert all(site.masks is None for site in sites(network))
    finally:
        network.eval()


def test_masks_keep_the_share_that_the_rate_says(trained_twin):
    masks = draw_masks(trained_twin.network, 200, "all", 1)
    kept = torch.cat([mask.flatten() for mask in masks.values()]).float().mean()
    assert abs(float(kept) - 0.9) < 0.01


def test_decoder_scope_leaves_the_encoder_alone(trained_twin):
    names = draw_masks(trained_twin.network, 2, "decoder", 1)
    assert names
    assert all(name.startswith("decoder.") for name in names)
