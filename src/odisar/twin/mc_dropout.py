"""Monte Carlo dropout with stored masks (Gal and Ghahramani, 2016).

The N masks are drawn once, from the seed, and kept with the model. Every window meets the same N
sub-networks, so a window's variance depends neither on its batch nor on the order of scoring, and
a stream gives what a batch gives.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Literal

import torch

from odisar.seeding import derive_seed
from odisar.twin.layers import Dropout
from odisar.twin.transformer import TwinOutput, TwinTransformer

DropoutScope = Literal["all", "decoder"]
#: Names of dropout sites before the decoder.
_ENCODER_PREFIXES = ("embed_dropout", "encoder.")


def draw_masks(
    network: TwinTransformer, draws: int, scope: DropoutScope, seed: int
) -> dict[str, torch.Tensor]:
    """Draw masks (draw, token, feature) for every dropout site in the scope, from a seed.

    Kept features are 1 and dropped ones 0, as bytes; ``stored_masks`` rescales them.
    """
    masks: dict[str, torch.Tensor] = {}
    for name, site in _sites(network):
        if scope == "decoder" and name.startswith(_ENCODER_PREFIXES):
            continue
        random = torch.Generator().manual_seed(derive_seed(seed, "dropout-mask", name))
        kept = torch.rand(draws, site.tokens, site.features, generator=random) >= site.rate
        masks[name] = kept.to(torch.uint8)
    return masks


@contextmanager
def stored_masks(network: TwinTransformer, masks: Mapping[str, torch.Tensor]) -> Iterator[None]:
    """Let the network apply stored masks; its mode and sites are as before afterwards."""
    was_training = network.training
    network.eval()
    try:
        for name, site in _sites(network):
            if name in masks:
                weight = next(network.parameters())
                site.masks = masks[name].to(weight.device, weight.dtype) / (1 - site.rate)
        yield
    finally:
        for _, site in _sites(network):
            site.masks = None
        network.train(was_training)


@torch.inference_mode()
def draw_forecasts(
    network: TwinTransformer,
    masks: Mapping[str, torch.Tensor],
    context: torch.Tensor,
    known_future: torch.Tensor,
) -> TwinOutput:
    """Return what the twin says in every draw: (draw, window, ...), shapes as in ``TwinOutput``.

    With masks in the decoder only, the encoder runs once for all draws.
    """
    draws = next(iter(masks.values())).shape[0]
    in_encoder = any(name.startswith(_ENCODER_PREFIXES) for name in masks)
    with stored_masks(network, masks):
        repeated = context.repeat(draws, 1, 1)
        memory = (
            network.encode(repeated) if in_encoder else network.encode(context).repeat(draws, 1, 1)
        )
        output = network.decode(memory, repeated, known_future.repeat(draws, 1, 1))

    def by_draw(x: torch.Tensor) -> torch.Tensor:
        return x.reshape(draws, len(context), *x.shape[1:])

    return TwinOutput(
        by_draw(output.forecast), by_draw(output.reconstruction), by_draw(output.next_sample)
    )


def _sites(network: TwinTransformer) -> list[tuple[str, Dropout]]:
    return [(name, part) for name, part in network.named_modules() if isinstance(part, Dropout)]
