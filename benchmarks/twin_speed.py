"""Time the twin with patches against the paper's, and dropout's two scopes, side by side.

Run it on an idle machine: ``PYTHONPATH=src python benchmarks/twin_speed.py``. One thread, the
same windows for all; ratios are what carries over to another machine. No recordings are needed.
"""

import time
from collections.abc import Callable

import torch
import torch.nn.functional as F

from odisar.config.learning import TwinConfig
from odisar.twin.devices import use_one_thread
from odisar.twin.mc_dropout import draw_forecasts, draw_masks
from odisar.twin.transformer import TwinTransformer
from odisar.windows.windowing import WindowSpec

SPEC = WindowSpec(60, 60, outputs=(1, 2, 3, 4, 5), commands=(0,), known_ahead=())
CHANNELS, BATCH, DRAWS = 6, 16, 20


def network(patch_steps: int) -> TwinTransformer:
    """Return the paper's twin with patches of so many steps."""
    torch.manual_seed(0)
    config = TwinConfig(
        patch_steps=patch_steps,
        model_dim=64,
        heads=4,
        layers=3,
        feedforward_dim=128,
        reconstruction_dim=128,
        dropout=0.1,
        detach_reconstruction=False,
        closed_form_lags=5,
        residual_forecast=False,
    )
    return TwinTransformer(config, SPEC, CHANNELS)


def batch(windows: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Return random contexts, and no command known ahead."""
    return torch.randn(windows, SPEC.context_steps, CHANNELS), torch.empty(windows, 60, 0)


def seconds(work: Callable[[], object], repeats: int) -> float:
    """Return the fastest of three rounds, in seconds a call."""
    work()
    rounds = []
    for _ in range(3):
        started = time.perf_counter()
        for _ in range(repeats):
            work()
        rounds.append((time.perf_counter() - started) / repeats)
    return min(rounds)


def train_step(twin: TwinTransformer) -> Callable[[], object]:
    """Return one optimiser step on a batch."""
    twin.train()
    optimiser = torch.optim.Adam(twin.parameters())
    context, known = batch(BATCH)
    truth = torch.randn(BATCH, 60, 5)

    def step() -> None:
        output = twin(context, known)
        loss = F.mse_loss(output.forecast, truth)
        loss = loss + F.mse_loss(output.reconstruction, output.forecast)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()

    return step


def score(twin: TwinTransformer) -> Callable[[], object]:
    """Return one deterministic pass over 256 windows."""
    twin.eval()
    inputs = batch(256)

    def work() -> object:
        with torch.inference_mode():
            return twin(*inputs)

    return work


def main() -> None:
    """Print milliseconds a window and ratios."""
    use_one_thread()
    print("ms a window        patch 5   patch 1   ratio")
    for name, make, windows in (("train", train_step, BATCH), ("score", score, 256)):
        five, one = (1e3 * seconds(make(network(p)), 5) / windows for p in (5, 1))
        print(f"{name:<18}{five:8.3f}  {one:8.3f}  {one / five:6.1f}")
    twin, inputs = network(5), batch(32)
    times = {}
    for scope in ("all", "decoder"):
        masks = draw_masks(twin, DRAWS, scope, 0)
        times[scope] = 1e3 * seconds(lambda m=masks: draw_forecasts(twin, m, *inputs), 3) / 32
    ratio = times["all"] / times["decoder"]
    print(f"\n{DRAWS} dropout draws, ms a window: all {times['all']:.2f}, ", end="")
    print(f"decoder only {times['decoder']:.2f}, ratio {ratio:.1f}")


if __name__ == "__main__":
    main()
