"""Attention, feed-forward and dropout layers of the twin."""

from typing import cast

import torch
import torch.nn.functional as F
from torch import nn


class Dropout(nn.Module):
    """Dropout that can also apply stored masks, one for every draw, whatever the mode.

    In training it is ordinary dropout, in evaluation the identity. With ``masks`` (draw, token,
    feature) set (see ``twin.mc_dropout``) the batch is read as (draw, window) and every window of
    draw n meets mask n: N fixed sub-networks, so that a window's draws depend on no other window.
    """

    def __init__(self, rate: float, tokens: int, features: int) -> None:
        super().__init__()
        self.rate, self.tokens, self.features = rate, tokens, features
        self.masks: torch.Tensor | None = None

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return (batch, token, feature) with features dropped."""
        if self.masks is None:
            return F.dropout(x, self.rate, self.training)
        draws = self.masks.shape[0]
        by_draw = x.view(draws, -1, self.tokens, self.features)
        return (by_draw * self.masks[:, None]).view_as(x)


class Attention(nn.Module):
    """Multi-head attention over time (Vaswani et al. 2017), without attention dropout.

    Batch first by construction: a token attends to tokens of its own window only.
    """

    def __init__(self, model_dim: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.query = nn.Linear(model_dim, model_dim)
        self.key_value = nn.Linear(model_dim, 2 * model_dim)
        self.out = nn.Linear(model_dim, model_dim)

    def forward(
        self, x: torch.Tensor, memory: torch.Tensor, *, causal: bool = False
    ) -> torch.Tensor:
        """Attend from ``x`` (batch, token, feature) to ``memory`` (batch, token, feature).

        With ``causal`` a token attends to none after its own place.
        """
        query = self._split(self.query(x))
        key, value = (self._split(part) for part in self.key_value(memory).chunk(2, dim=-1))
        attended = F.scaled_dot_product_attention(query, key, value, is_causal=causal)
        return cast("torch.Tensor", self.out(attended.transpose(1, 2).flatten(2)))

    def _split(self, x: torch.Tensor) -> torch.Tensor:
        return x.view(*x.shape[:2], self.heads, -1).transpose(1, 2)


class FeedForward(nn.Sequential):
    """Two linear maps with a ReLU between, as published."""

    def __init__(self, model_dim: int, hidden_dim: int, rate: float, tokens: int) -> None:
        super().__init__(
            nn.Linear(model_dim, hidden_dim),
            nn.ReLU(),
            Dropout(rate, tokens, hidden_dim),
            nn.Linear(hidden_dim, model_dim),
        )


class EncoderLayer(nn.Module):
    """Pre-norm causal self-attention and feed-forward, each with a residual path."""

    def __init__(
        self, model_dim: int, heads: int, hidden_dim: int, rate: float, tokens: int
    ) -> None:
        super().__init__()
        self.attention_norm = nn.LayerNorm(model_dim)
        self.attention = Attention(model_dim, heads)
        self.attention_dropout = Dropout(rate, tokens, model_dim)
        self.feedforward_norm = nn.LayerNorm(model_dim)
        self.feedforward = FeedForward(model_dim, hidden_dim, rate, tokens)
        self.feedforward_dropout = Dropout(rate, tokens, model_dim)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return (batch, token, feature)."""
        normed = self.attention_norm(x)
        x = x + self.attention_dropout(self.attention(normed, normed, causal=True))
        return cast(
            "torch.Tensor", x + self.feedforward_dropout(self.feedforward(self.feedforward_norm(x)))
        )


class DecoderLayer(EncoderLayer):
    """An encoder layer with attention to the encoder's output in between."""

    def __init__(
        self, model_dim: int, heads: int, hidden_dim: int, rate: float, tokens: int
    ) -> None:
        super().__init__(model_dim, heads, hidden_dim, rate, tokens)
        self.cross_norm = nn.LayerNorm(model_dim)
        self.cross_attention = Attention(model_dim, heads)
        self.cross_dropout = Dropout(rate, tokens, model_dim)

    def decode(self, x: torch.Tensor, memory: torch.Tensor) -> torch.Tensor:
        """Return (batch, horizon token, feature) from queries and the encoder's ``memory``."""
        normed = self.attention_norm(x)
        x = x + self.attention_dropout(self.attention(normed, normed))
        x = x + self.cross_dropout(self.cross_attention(self.cross_norm(x), memory))
        return cast(
            "torch.Tensor", x + self.feedforward_dropout(self.feedforward(self.feedforward_norm(x)))
        )
