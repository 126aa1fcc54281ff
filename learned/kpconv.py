# SPDX-License-Identifier: MIT
"""Rigid kernel point convolution (KPConv) with GeoTransformer's positive-sum normaliser (methods 3.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.kernel_points import kernel_points

# Entries of (queries, kernel points, neighbours) looked at in one go: small enough for the cache.
_CHUNK_ENTRIES = 2**19


@dataclass(frozen=True)
class Influence:
    """The non-zero influences of a layer, one bag for each (query, kernel point), in that order.

    Only about a tenth of all (query, kernel point, neighbour) triples lie within the kernel points' reach, and
    no shadow ever does: the sparse form does a tenth of the multiplications of the dense one.
    """

    index: Tensor  # (E,) int64: support of each entry
    weight: Tensor  # (E,) float32 in (0, 1]
    offsets: Tensor  # (N * K,) int64: where each bag begins


def kernel_influence(
    queries: Tensor, supports: Tensor, neighbors: Tensor, kernel: Tensor, sigma: float
) -> Influence:
    """Linear influence ``max(0, 1 - |y_j - q_i - x_k| / sigma)`` of every neighbour on every kernel point.

    Parameters
    ----------
    queries, supports
        (N, 3), (M, 3) metres.
    neighbors
        (N, k) int64 into the supports, pad M.
    kernel
        (K, 3) metres.
    sigma
        Reach in metres.
    """
    n_kernel, n_slots = kernel.shape[0], neighbors.shape[1]
    far = torch.full((1, 3), 1e6, dtype=supports.dtype, device=supports.device)
    padded = torch.cat([supports, far])
    size = max(1, _CHUNK_ENTRIES // (n_kernel * n_slots))
    parts = [
        _influence_chunk(q, padded, near, kernel, sigma)
        for q, near in zip(queries.split(size), neighbors.split(size), strict=True)
    ]
    counts = torch.cat([part[2] for part in parts])
    offsets = counts.cumsum(0) - counts
    return Influence(torch.cat([part[0] for part in parts]), torch.cat([part[1] for part in parts]), offsets)


def _influence_chunk(
    queries: Tensor, supports: Tensor, neighbors: Tensor, kernel: Tensor, sigma: float
) -> tuple[Tensor, Tensor, Tensor]:
    local = (supports[neighbors] - queries[:, None]).transpose(1, 2)  # (n, 3, k)
    # |a - x|^2 as |a|^2 - 2 a.x + |x|^2: no (n, K, k, 3) tensor
    squared = torch.matmul(-2.0 * kernel, local)  # (n, K, k)
    squared += local.square().sum(1)[:, None]
    squared += kernel.square().sum(1)[None, :, None]
    weight = 1.0 - squared.clamp_min_(0.0).sqrt_().div_(sigma)
    reached = weight > 0.0
    entry = reached.flatten().nonzero()[:, 0]
    slots = neighbors.shape[1]
    query = entry.div(slots * kernel.shape[0], rounding_mode="floor")
    support = neighbors.flatten()[query * slots + entry % slots]
    return support, weight.flatten()[entry], reached.sum(2).flatten()


def kernel_point_convolution(
    features: Tensor, neighbors: Tensor, influence: Influence, weights: Tensor, bias: Tensor | None
) -> Tensor:
    """Convolve: ``f_i = 1/n_i sum_k (sum_j h_ijk F_j) W_k + b``.

    ``n_i`` counts the neighbours whose features have a positive sum (at least 1), which is what the published
    weights were trained with.

    Parameters
    ----------
    features
        (M, C_in) of the supports.
    neighbors
        (N, k) int64 into the supports, pad M.
    influence
        Of the same queries, supports and neighbours.
    weights
        (K, C_in, C_out).
    bias
        (C_out,) or None.

    Returns
    -------
    Tensor
        (N, C_out).
    """
    n_kernel, dim_in, dim_out = weights.shape
    gathered = F.embedding_bag(
        influence.index, features, influence.offsets, mode="sum", per_sample_weights=influence.weight
    )  # (N * K, C_in)
    out = gathered.view(-1, n_kernel * dim_in) @ weights.reshape(n_kernel * dim_in, dim_out)
    positive = torch.cat([features.sum(1) > 0, features.new_zeros(1, dtype=torch.bool)])
    out = out / positive[neighbors].sum(1).clamp_min(1)[:, None]
    return out if bias is None else out + bias


class KPConv(nn.Module):
    """A kernel point convolution from ``dim_in`` to ``dim_out`` channels; ``radius``, ``sigma`` in metres."""

    kernel: Tensor

    def __init__(
        self, dim_in: int, dim_out: int, radius: float, sigma: float, n_kernel: int, rng: np.random.Generator | None
    ) -> None:
        super().__init__()
        self.sigma = sigma
        self.weights = nn.Parameter(torch.empty(n_kernel, dim_in, dim_out))
        self.bias = nn.Parameter(torch.empty(dim_out))
        self.register_buffer("kernel", torch.from_numpy(kernel_points(n_kernel, radius, rng)))
        bound = 1.0 / math.sqrt(dim_in * dim_out)
        nn.init.uniform_(self.weights, -bound, bound)
        nn.init.uniform_(self.bias, -bound, bound)

    def forward(
        self, features: Tensor, queries: Tensor, supports: Tensor, neighbors: Tensor, influence: Influence | None = None
    ) -> Tensor:
        """(M, C_in) to (N, C_out); ``influence`` may be handed in by a stage that shares its kernel points."""
        if influence is None:
            influence = kernel_influence(queries, supports, neighbors, self.kernel, self.sigma)
        return kernel_point_convolution(features, neighbors, influence, self.weights, self.bias)
