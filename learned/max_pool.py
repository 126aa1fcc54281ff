# SPDX-License-Identifier: MIT
"""Max-pooling over neighbours, slot by slot: no (queries, neighbours, channels) tensor either way."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

_CHUNK_VALUES = 2**16  # a quarter of a megabyte of the output at a time


def max_pool(features: Tensor, neighbors: Tensor) -> Tensor:
    """Largest feature of each query's neighbours, (M, C) and (N, k) to (N, C); a shadow (M) counts as 0."""
    return _MaxPool.apply(features, neighbors)


class _MaxPool(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, features: Tensor, neighbors: Tensor) -> Tensor:
        padded = torch.cat([features, features.new_zeros(1, features.shape[1])])
        size = max(1, _CHUNK_VALUES // features.shape[1])
        out = torch.cat([_largest(padded, rows.t().contiguous()) for rows in neighbors.split(size)])
        ctx.save_for_backward(padded, neighbors, out)
        return out

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:
        padded, neighbors, out = ctx.saved_tensors
        slots = neighbors.t().contiguous()
        ties = sum((padded.index_select(0, slot) == out).to(out.dtype) for slot in slots)
        shared = gradient / ties  # equal neighbours share the gradient, as in torch.amax
        total = torch.zeros_like(padded)
        for slot in slots:
            total.index_add_(0, slot, shared * (padded.index_select(0, slot) == out))
        return total[:-1], None


def _largest(padded: Tensor, slots: Tensor) -> Tensor:
    out = padded.index_select(0, slots[0])
    for slot in slots[1:]:
        torch.maximum(out, padded.index_select(0, slot), out=out)
    return out
