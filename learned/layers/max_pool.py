# SPDX-License-Identifier: MIT
"""Max-pooling over neighbours without a (queries, neighbours, channels) tensor, forward or backward."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional as F

_CHUNK_VALUES = 2**16  # a quarter of a megabyte of the output at a time


def max_pool(features: Tensor, neighbors: Tensor) -> Tensor:
    """Largest feature of each query's neighbours, (M, C) and (N, k) to (N, C); padding (M) counts as 0.

    The gradient goes to the first of the neighbours that share the maximum.
    """
    padded = F.pad(features, (0, 0, 0, 1))
    if padded.requires_grad:
        # slower than slot by slot, but it keeps the index of each maximum
        return F.embedding_bag(neighbors, padded, mode="max")
    size = max(1, _CHUNK_VALUES // features.shape[1])
    return torch.cat([_largest(padded, rows.t().contiguous()) for rows in neighbors.split(size)])


def _largest(padded: Tensor, slots: Tensor) -> Tensor:
    out = padded.index_select(0, slots[0])
    for slot in slots[1:]:
        torch.maximum(out, padded.index_select(0, slot), out=out)
    return out
