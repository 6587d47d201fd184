"""What holds of every network that is fitted here, and what holds of each."""

import importlib
import importlib.util
from dataclasses import replace

import pytest
import torch

from odisar.errors import OdisarError
from odisar.fitting import FitBudget
from odisar.forecasters.gru import GruForecaster, GruSize
from odisar.forecasters.interface import WindowShape
from odisar.forecasters.network_forecaster import NetworkForecaster
from odisar.forecasters.persistence import Persistence
from odisar.forecasters.pilot import (
    GanForecaster,
    GanObjective,
    GenerativeSize,
    Generator,
    RnnForecaster,
    RnnSize,
    VaeForecaster,
    VaeNetwork,
)
from odisar.forecasters.published_mixer import MixerForecaster, MixerNetwork, MixerSize
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from small_system import SPEC, make_recording

BUDGET = FitBudget(steps=200, batch_size=32, learning_rate=5e-3, gradient_clip=1.0, validations=4)
SEED = 3
GENERATIVE = GenerativeSize(hidden_dim=32, latent_dim=3, weight=0.1)
MIXER = MixerSize(patch_steps=5, model_dim=8, layers=1, dropout=0.1)
SCALER = Scaler.fit([make_recording(f"train-{i}") for i in range(6)], SPEC)
MAKERS = {
    "gru": lambda *given: GruForecaster(GruSize(16, 32), *given),
    "rnn": lambda *given: RnnForecaster(RnnSize(16), *given),
    "vae": lambda *given: VaeForecaster(GENERATIVE, *given),
    "gan": lambda *given: GanForecaster(GENERATIVE, *given),
    "mixer": lambda *given: MixerForecaster(MIXER, *given),
}
# The mixer's library is in an optional group of dependencies.
NEEDS_LIBRARY = pytest.mark.skipif(
    importlib.util.find_spec("transformers") is None, reason="make study-setup installs it"
)
KINDS = [pytest.param(name, marks=NEEDS_LIBRARY if name == "mixer" else ()) for name in MAKERS]


@pytest.fixture(scope="module")
def known() -> tuple[WindowSet, WindowSet]:
    spec = replace(SPEC, known_ahead=(0,))
    train = [make_recording(f"train-{i}") for i in range(6)]
    validation = [make_recording(f"validation-{i}") for i in range(2)]
    scaler = Scaler.fit(train, spec)
    return WindowSet(train, scaler, spec), WindowSet(validation, scaler, spec, stride_steps=10)


def first_windows(windows: WindowSet, count: int = 9):
    return windows.gather(torch.arange(count))


@pytest.mark.parametrize("kind", KINDS)
def test_a_short_fit_beats_persistence(kind, windows):
    train, validation = windows
    forecaster: NetworkForecaster = MAKERS[kind](BUDGET, SEED)
    forecaster.fit(train, validation)
    batch = validation.gather(torch.arange(len(validation)))
    forecast = forecaster.forecast(batch.context, batch.known_future)
    held = Persistence(SCALER, SPEC)
    persistence = held.forecast(batch.context, batch.known_future)
    assert forecast.shape == batch.truth.shape
    assert not forecast.requires_grad
    assert ((forecast - batch.truth) ** 2).mean() < 0.7 * ((persistence - batch.truth) ** 2).mean()


@pytest.mark.parametrize("kind", KINDS)
def test_seed_and_windows_decide_the_forecast_and_nothing_around_it(kind, known):
    budget = replace(BUDGET, steps=12)
    batch = first_windows(known[1])
    found = []
    for noise, seed in ((0, 3), (99, 3), (0, 4)):
        torch.manual_seed(noise)
        forecaster = MAKERS[kind](budget, seed)
        forecaster.fit(*known)
        found.append(forecaster.forecast(batch.context, batch.known_future))
    assert torch.equal(found[0], found[1])
    assert not torch.equal(found[0], found[2])


@pytest.mark.parametrize("kind", KINDS)
def test_a_window_is_forecast_alike_alone_and_in_a_batch(kind, known):
    forecaster = MAKERS[kind](replace(BUDGET, steps=12), SEED)
    forecaster.fit(*known)
    batch = first_windows(known[1])
    together = forecaster.forecast(batch.context, batch.known_future)
    alone = forecaster.forecast(batch.context[4:5], batch.known_future[4:5])
    torch.testing.assert_close(alone[0], together[4], atol=2e-6, rtol=0)


@pytest.mark.parametrize("kind", KINDS)
def test_known_commands_and_the_context_move_the_forecast(kind, known):
    forecaster = MAKERS[kind](replace(BUDGET, steps=12), SEED)
    forecaster.fit(*known)
    batch = first_windows(known[1])
    forecast = forecaster.forecast(batch.context, batch.known_future)
    commanded = forecaster.forecast(batch.context, batch.known_future + 1)
    assert (forecast - commanded).abs().amax(dim=(1, 2)).min() > 1e-3
    moved = batch.context.clone()
    moved[:, -1] += 1
    observed = forecaster.forecast(moved, batch.known_future)
    assert (forecast - observed).abs().amax(dim=(1, 2)).min() > 1e-3


def test_a_step_of_the_rnn_sees_no_command_after_it(known):
    forecaster = MAKERS["rnn"](replace(BUDGET, steps=12), SEED)
    forecaster.fit(*known)
    batch = first_windows(known[1])
    later = batch.known_future.clone()
    later[:, 6:] += 5
    before = forecaster.forecast(batch.context, batch.known_future)
    after = forecaster.forecast(batch.context, later)
    assert torch.equal(before[:, :6], after[:, :6])
    assert not torch.equal(before[:, 6], after[:, 6])


def test_the_divergence_of_the_vae_is_zero_at_the_prior_and_counts_by_its_weight(known):
    torch.manual_seed(0)
    network = VaeNetwork(GENERATIVE, WindowShape.of(known[0]))
    batch = first_windows(known[0])

    def losses() -> list[float]:
        found = []
        for weight in (0.0, 2.0):
            torch.manual_seed(1)
            found.append(network.loss(batch, weight).item())
        return found

    last = network.encoder[-1]
    torch.nn.init.zeros_(last.weight)
    torch.nn.init.zeros_(last.bias)
    without, weighted = losses()
    assert weighted == pytest.approx(without)
    # Means of 1 and variances of 1: half a nat for each latent variable.
    last.bias.data[: GENERATIVE.latent_dim] = 1.0
    without, weighted = losses()
    assert weighted - without == pytest.approx(2.0 * 0.5, rel=1e-4)


def test_the_critic_learns_to_tell_and_leaves_the_generator_alone(known):
    torch.manual_seed(0)
    shape = WindowShape.of(known[0])
    generator, objective = Generator(GENERATIVE, shape), GanObjective(GENERATIVE, shape, 1e-2)
    before = [weight.clone() for weight in generator.parameters()]
    batch = first_windows(known[0], 64)
    for _ in range(60):
        objective(generator, batch)
    assert all(torch.equal(a, b) for a, b in zip(before, generator.parameters(), strict=True))
    made = generator(batch.context, batch.known_future)
    observed = objective._verdict(batch, batch.truth)
    assert (observed > 0).float().mean() > 0.9
    assert (objective._verdict(batch, made) < 0).float().mean() > 0.9


def test_a_missing_library_is_named_with_the_way_to_get_it(windows, monkeypatch):
    def missing(name: str):
        raise ModuleNotFoundError(name=name)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(OdisarError, match=r"'transformers'.*make study-setup"):
        MixerNetwork(MIXER, WindowShape.of(windows[0]))


def test_a_patch_as_long_as_the_context_is_refused(windows):
    with pytest.raises(OdisarError, match="patch_steps=20 must be below the context of 20"):
        MixerNetwork(replace(MIXER, patch_steps=20), WindowShape.of(windows[0]))
