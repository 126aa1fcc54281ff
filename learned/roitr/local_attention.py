# SPDX-License-Identifier: MIT
"""Attention of a point to its neighbours, with their point-pair features in the scores and in the values.

The position code is ``E ppf + e``, and the attention projects it by ``p`` for the scores and by ``vp`` for the values;
there is nothing between the two linear maps. Multiplied first, they are one map from 4 numbers to C, and as both the
product with the query and the weighted sum over the neighbours are linear too, no tensor of (neighbours, C) is needed:
queries are projected down to 4 numbers a head, and the weighted sum of 4 numbers up to C.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn import functional as F

_PPF = 4


class LocalAttention(nn.Module):
    """One local layer (model/transformer/ppftransformer.py, LocalPPFTransformer): no feed-forward part, no dropout.

    Parameters
    ----------
    in_dim, dim, out_dim
        Widths before, inside and after.
    heads
        Of the attention; divides ``dim``.
    fused
        Multiply the position codes' linear maps first. False computes each code as the original does, for comparison:
        the result is the same up to rounding.
    """

    def __init__(self, in_dim: int, dim: int, out_dim: int, heads: int, *, fused: bool = True) -> None:
        super().__init__()
        self.heads, self.fused = heads, fused
        self.in_proj = nn.Linear(in_dim, dim)
        self.code = nn.Linear(_PPF, dim)
        self.query, self.key, self.value = nn.Linear(dim, dim), nn.Linear(dim, dim), nn.Linear(dim, dim)
        self.position, self.position_value = nn.Linear(dim, dim), nn.Linear(dim, dim)
        self.linear = nn.Linear(dim, dim)
        self.norm = nn.LayerNorm(dim)
        self.out_proj = nn.Linear(dim, out_dim)

    def forward(self, features: Tensor, centres: Tensor | None, neighbors: Tensor, ppf: Tensor) -> Tensor:
        """Features (M, in) of a level to features (n, out) of its points ``centres``.

        Parameters
        ----------
        centres
            (n,) rows, or None for all M.
        neighbors
            (n, k) rows.
        ppf
            (n, k, 4) point-pair features of each centre with its neighbours.
        """
        projected = self.in_proj(features)
        own = projected if centres is None else projected[centres]
        weights = self.weights(projected, own, neighbors, ppf)
        value = F.embedding(neighbors, self.value(projected)).unflatten(2, (self.heads, -1))  # (n, k, h, c)
        # Products and sums without reordering: einsum would copy the gathered tensors first, at half the speed.
        attended = (weights.transpose(1, 2)[..., None] * value).sum(1) + self._position_values(weights, ppf)
        # The residual is the projected feature, not the layer's input.
        return self.out_proj(self.norm(self.linear(attended.flatten(1)) + own))

    def weights(self, projected: Tensor, own: Tensor, neighbors: Tensor, ppf: Tensor) -> Tensor:
        """Attention (n, h, k) of centres with projected features (n, C) to their neighbours among (M, C)."""
        query = self.query(own).unflatten(1, (self.heads, -1))  # (n, h, c)
        key = F.embedding(neighbors, self.key(projected))  # (n, k, C)
        products = (key * query.flatten(1)[:, None]).unflatten(2, (self.heads, -1))
        scores = products.sum(3).transpose(1, 2) + self._position_scores(query, ppf)
        return torch.softmax(scores / math.sqrt(query.shape[2]), dim=-1)

    def _position_scores(self, query: Tensor, ppf: Tensor) -> Tensor:
        if not self.fused:
            code = self.position(self.code(ppf)).unflatten(2, (self.heads, -1))
            return torch.einsum("nhc,nkhc->nhk", query, code)
        weight, bias = self._together(self.position)
        low = torch.einsum("nhc,hcp->nhp", query, weight)
        return low @ ppf.transpose(1, 2) + (query * bias).sum(2, keepdim=True)

    def _position_values(self, weights: Tensor, ppf: Tensor) -> Tensor:
        if not self.fused:
            code = self.position_value(self.code(ppf)).unflatten(2, (self.heads, -1))
            return torch.einsum("nhk,nkhc->nhc", weights, code)
        weight, bias = self._together(self.position_value)
        # The weights of a point sum to one, so the bias is unchanged.
        return torch.einsum("nhp,hcp->nhc", weights @ ppf, weight) + bias

    def _together(self, layer: nn.Linear) -> tuple[Tensor, Tensor]:
        """Code and projection as one map: weight (h, c, 4) and bias (h, c)."""
        weight = layer.weight @ self.code.weight
        bias = layer.weight @ self.code.bias + layer.bias
        return weight.unflatten(0, (self.heads, -1)), bias.unflatten(0, (self.heads, -1))


class LocalBlock(nn.Module):
    """Local attention within a level, LayerNorm, skip, ReLU."""

    def __init__(self, dim: int, hidden: int, heads: int) -> None:
        super().__init__()
        self.attention = LocalAttention(dim, hidden, dim, heads)
        self.norm = nn.LayerNorm(dim)

    def forward(self, features: Tensor, neighbors: Tensor, ppf: Tensor) -> Tensor:
        """(N, C) to (N, C)."""
        return torch.relu(self.norm(self.attention(features, None, neighbors, ppf)) + features)
