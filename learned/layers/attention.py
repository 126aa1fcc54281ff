# SPDX-License-Identifier: MIT
"""Multi-head attention with optional geometric or positional terms, and the post-norm layer around it."""

from __future__ import annotations

import math
from typing import Protocol

import torch
from torch import Tensor, nn


class Structure(Protocol):
    """An embedding (n, m, d) of pairs, of which only products are wanted."""

    def products(self, vectors: Tensor) -> Tensor:
        """(n, h, d) to (h, n, m)."""


def split_heads(features: Tensor, heads: int) -> Tensor:
    """(n, d) to (heads, n, d / heads)."""
    n, dim = features.shape
    return features.view(n, heads, dim // heads).transpose(0, 1)


def merge_heads(features: Tensor) -> Tensor:
    """(heads, n, c) to (n, heads * c)."""
    heads, n, width = features.shape
    return features.transpose(0, 1).reshape(n, heads * width)


class Attention(nn.Module):
    """Multi-head attention; with ``geometric`` the score gains ``q_i . W_p r_ij`` (docs/methods.md 6.6).

    Scores are divided by the root of a head's width, or of ``scale`` where that is given.
    """

    def __init__(self, dim: int, heads: int, *, geometric: bool = False, scale: int | None = None) -> None:
        super().__init__()
        self.heads = heads
        self.scale = math.sqrt(dim // heads if scale is None else scale)
        self.query, self.key, self.value = nn.Linear(dim, dim), nn.Linear(dim, dim), nn.Linear(dim, dim)
        self.structure = nn.Linear(dim, dim) if geometric else None

    def forward(
        self,
        features: Tensor,
        memory: Tensor,
        structure: Tensor | Structure | None = None,
        values: Tensor | None = None,
    ) -> Tensor:
        """(n, d) attends to (m, d); ``structure`` is (n, m, d), ``values`` (m, d) replaces the memory's."""
        query = split_heads(self.query(features), self.heads)
        key = split_heads(self.key(memory), self.heads)
        scores = query @ key.transpose(1, 2)  # (h, n, m)
        if structure is not None:
            scores = scores + self._structure_scores(query, structure)
        weights = torch.softmax(scores / self.scale, dim=-1)
        value = self.value(memory if values is None else values)
        return merge_heads(weights @ split_heads(value, self.heads))

    def _structure_scores(self, query: Tensor, structure: Tensor | Structure) -> Tensor:
        # q . (W r + b) = (q W) . r + q . b: projecting the n queries of each head instead of the n * m embeddings
        # saves a factor of d / h in multiplications and an (n, m, d) tensor.
        assert self.structure is not None
        heads, _, width = query.shape
        weight = self.structure.weight.view(heads, width, -1)
        projected = (query @ weight).transpose(0, 1)  # (n, h, d)
        constant = (query * self.structure.bias.view(heads, 1, width)).sum(2, keepdim=True)  # (h, n, 1)
        if isinstance(structure, Tensor):
            return (projected @ structure.transpose(1, 2)).transpose(0, 1) + constant
        return structure.products(projected) + constant


class AttentionLayer(nn.Module):
    """Attention, linear, residual, LayerNorm; then a feed-forward part of twice the width, the same way."""

    def __init__(self, dim: int, heads: int, *, geometric: bool = False) -> None:
        super().__init__()
        self.attention = Attention(dim, heads, geometric=geometric)
        self.linear = nn.Linear(dim, dim)
        self.norm = nn.LayerNorm(dim)
        self.feed_forward = FeedForward(dim)

    def forward(
        self, features: Tensor, memory: Tensor, structure: Tensor | Structure | None = None
    ) -> Tensor:
        """(n, d), (m, d) to (n, d)."""
        attended = self.linear(self.attention(features, memory, structure))
        return self.feed_forward(self.norm(attended + features))


class FeedForward(nn.Module):
    """``LN(x + W2 relu(W1 x))`` with an inner width of 2d."""

    def __init__(self, dim: int) -> None:
        super().__init__()
        self.expand, self.squeeze = nn.Linear(dim, 2 * dim), nn.Linear(2 * dim, dim)
        self.norm = nn.LayerNorm(dim)

    def forward(self, features: Tensor) -> Tensor:
        """(n, d) to (n, d)."""
        return self.norm(features + self.squeeze(torch.relu(self.expand(features))))
