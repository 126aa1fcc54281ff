# SPDX-License-Identifier: MIT
"""Attention with a message MLP (Sarlin et al. 2020, SuperGlue) between two clouds, as in Predator and CoFiNet."""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.layers.instance_norm import instance_norm

Clouds = tuple[Tensor, Tensor]
Masks = tuple[Tensor | None, Tensor | None]


class InterleavedAttention(nn.Module):
    """Multi-head attention whose heads are interleaved: channel c of a projection belongs to head ``c % heads``.

    Such weights load into attention with contiguous heads without an error, but give wrong results.
    """

    def __init__(self, dim: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.query, self.key, self.value = (nn.Linear(dim, dim) for _ in range(3))
        self.merge = nn.Linear(dim, dim)

    def forward(self, features: Tensor, memory: Tensor, mask: Tensor | None = None) -> Tensor:
        """(..., n, d) attends to (..., m, d), of which ``mask`` (..., m) bool may exclude some."""
        query, key, value = (
            self._split(layer(rows))
            for layer, rows in ((self.query, features), (self.key, memory), (self.value, memory))
        )
        allowed = None if mask is None else mask[..., None, None, :]
        gathered = F.scaled_dot_product_attention(query, key, value, attn_mask=allowed)
        merged: Tensor = self.merge(gathered.movedim(-3, -1).flatten(-2))
        return merged

    def _split(self, features: Tensor) -> Tensor:
        # (..., n, d) to (..., heads, n, d / heads)
        return features.unflatten(-1, (-1, self.heads)).movedim(-1, -3)


class MessageLayer(nn.Module):
    """The message of an attention layer: attention, then two layers on features and message concatenated.

    Between the two lies an instance normalisation over the cloud's own points.
    """

    def __init__(self, dim: int, heads: int) -> None:
        super().__init__()
        self.attention = InterleavedAttention(dim, heads)
        self.expand = nn.Linear(2 * dim, 2 * dim)
        self.squeeze = nn.Linear(2 * dim, dim)
        nn.init.zeros_(self.squeeze.bias)

    def forward(
        self,
        features: Tensor,
        memory: Tensor,
        own_mask: Tensor | None = None,
        memory_mask: Tensor | None = None,
    ) -> Tensor:
        """(..., n, d) and (..., m, d) to the message (..., n, d), which the caller adds."""
        message = self.attention(features, memory, memory_mask)
        hidden = instance_norm(self.expand(torch.cat([features, message], -1)), own_mask).relu()
        out: Tensor = self.squeeze(hidden)
        return out


class MessageBlock(nn.Module):
    """Both clouds attend to themselves, or to each other; one set of weights, with a residual.

    In a cross block the source goes first and the target attends to the updated source, so that exchanging the clouds
    changes the numbers.
    """

    def __init__(self, kind: Literal["self", "cross"], dim: int, heads: int) -> None:
        super().__init__()
        self.kind = kind
        self.layer = MessageLayer(dim, heads)

    def forward(self, clouds: Clouds, masks: Masks = (None, None)) -> Clouds:
        """Features (..., n, d), (..., m, d) of source and target; ``masks`` exclude rows."""
        source, target = clouds
        if self.kind == "self":
            source = source + self.layer(source, source, masks[0], masks[0])
            return source, target + self.layer(target, target, masks[1], masks[1])
        source = source + self.layer(source, target, masks[0], masks[1])
        return source, target + self.layer(target, source, masks[1], masks[0])
