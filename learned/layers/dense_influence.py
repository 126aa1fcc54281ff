# SPDX-License-Identifier: MIT
"""The dense geometry of a KPConv, one slot for every neighbour, for GPUs (docs/methods.md 3.2).

The sparse form of `hybridreg.learned.layers.influence` needs a tenth of the multiplications but some thirty times as
many kernel launches, and it has to read back from the GPU how many neighbours each kernel point influences.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

_NOWHERE = 1e6  # metres: the position of the padding row, beyond every kernel point


@dataclass(frozen=True)
class DenseLinks:
    """All neighbours of all queries."""

    neighbors: Tensor  # (N, k) int64 into the supports, pad M
    local: Tensor  # (N, k, 3) support minus query, metres

    @classmethod
    def find(
        cls, queries: Tensor, supports: Tensor, neighbors: Tensor, *, cylindrical: bool = False
    ) -> DenseLinks:
        """As `hybridreg.learned.layers.influence.find_links`."""
        padded = F.pad(supports, (0, 0, 0, 1), value=_NOWHERE)
        local = _rows(padded, neighbors) - queries[:, None]
        if cylindrical:
            across = local[..., :2].norm(dim=2)
            local = torch.stack([across, torch.zeros_like(across), local[..., 2]], dim=2)
        return cls(neighbors, local)

    def influence(self, kernel: Tensor, sigma: float) -> DenseInfluence:
        """Of every neighbour on every kernel point (K, 3) metres: ``max(0, 1 - |y_j - q_i - x_k| / sigma)``."""
        distance = (self.local[:, :, None] - kernel).norm(dim=3)
        return DenseInfluence(self.neighbors, (1.0 - distance / sigma).clamp_min_(0.0))


@dataclass(frozen=True)
class DenseInfluence:
    """Influences of a layer, most of them 0."""

    neighbors: Tensor  # (N, k) int64 into the supports, pad M
    weight: Tensor  # (N, k, K)

    def convolve(self, features: Tensor, weights: Tensor) -> Tensor:
        """``sum_k H_k F W_k``: (M, C_in) and (K, C_in, C_out) to (N, C_out)."""
        gathered = _rows(F.pad(features, (0, 0, 0, 1)), self.neighbors)
        sums = self.weight.transpose(1, 2) @ gathered  # (N, K, C_in)
        return sums.flatten(1) @ weights.flatten(0, 1)


def _rows(table: Tensor, index: Tensor) -> Tensor:
    # not by ``table[index]``, whose gradient sorts the index
    return table.index_select(0, index.flatten()).view(*index.shape, table.shape[1])
