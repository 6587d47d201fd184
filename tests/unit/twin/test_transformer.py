import torch

from odisar.config.learning import TwinConfig
from odisar.twin.transformer import TwinTransformer
from odisar.windows.windowing import WindowSpec
from small_system import SPEC


def network(spec: WindowSpec = SPEC, patch_steps: int = 5) -> TwinTransformer:
    torch.manual_seed(0)
    config = TwinConfig(
        patch_steps=patch_steps,
        model_dim=16,
        heads=2,
        layers=2,
        feedforward_dim=32,
        reconstruction_dim=16,
        dropout=0.1,
        detach_reconstruction=False,
        closed_form_lags=5,
        residual_forecast=False,
    )
    return TwinTransformer(config, spec, 3).eval()


def test_forecast_and_reconstruction_cover_the_horizon():
    for patch_steps in (1, 5):
        output = network(patch_steps=patch_steps)(torch.randn(4, 20, 3), torch.empty(4, 10, 0))
        assert output.forecast.shape == (4, 10, 2)
        assert output.reconstruction.shape == (4, 10, 2)


def test_a_window_is_forecast_alone_whatever_stands_in_its_batch():
    twin, context = network(), torch.randn(6, 20, 3)
    known = torch.empty(6, 10, 0)
    together = twin(context, known).forecast
    changed = context.clone()
    changed[1:] += 5
    assert torch.equal(twin(changed, known).forecast[0], together[0])
    assert torch.equal(twin(context.flip(0), known).forecast.flip(0), together)


def test_every_input_step_reaches_the_forecast():
    twin, context = network(), torch.randn(1, 20, 3)
    known = torch.empty(1, 10, 0)
    before = twin(context, known).forecast
    for step in range(20):
        changed = context.clone()
        changed[0, step] += 1
        assert not torch.allclose(twin(changed, known).forecast, before)


def test_commands_known_ahead_reach_the_forecast_and_others_cannot():
    spec = WindowSpec(20, 10, (1, 2), (0,), (0,))
    twin, context = network(spec), torch.randn(1, 20, 3)
    known = torch.randn(1, 10, 1)
    assert not torch.allclose(twin(context, known).forecast, twin(context, known + 1).forecast)
    assert network().embed_known is None
