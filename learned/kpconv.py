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

# Entries of (kernel points, queries, neighbours) looked at in one go: a megabyte, small enough for the cache.
_CHUNK_ENTRIES = 2**18


@dataclass(frozen=True)
class Influence:
    """The non-zero influences of a layer, one bag for each (kernel point, query) of a chunk of queries.

    Only about a tenth of all (query, kernel point, neighbour) triples lie within the kernel points' reach,
    and no shadow ever does: the sparse form does a tenth of the multiplications of the dense one.
    """

    index: Tensor  # (E,) int64: support of each entry
    weight: Tensor  # (E,) float32 in (0, 1]
    offsets: Tensor  # (N * K,) int64: where each bag begins
    chunk: int  # queries of a chunk; the last one may have fewer


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
    far = torch.full((1, 3), 1e6, dtype=supports.dtype, device=supports.device)
    padded = torch.cat([supports, far])
    size = max(1, _CHUNK_ENTRIES // (kernel.shape[0] * neighbors.shape[1]))
    parts = [
        _influence_chunk(F.embedding(near, padded) - q[:, None], near, kernel, sigma)
        for q, near in zip(queries.split(size), neighbors.split(size), strict=True)
    ]
    index, weight, counts = (torch.cat([part[i] for part in parts]) for i in range(3))
    return Influence(index, weight, counts.cumsum(0) - counts, size)


def _influence_chunk(
    local: Tensor, neighbors: Tensor, kernel: Tensor, sigma: float
) -> tuple[Tensor, Tensor, Tensor]:
    n, slots = neighbors.shape
    local = local.view(n * slots, 3)
    # |a - x|^2 as |x|^2 - 2 a.x + |a|^2: one matrix product, no (n, k, K, 3) tensor
    squared = torch.addmm(kernel.square().sum(1, keepdim=True), kernel, local.t(), alpha=-2.0)
    squared += local.square().sum(1)
    reached = squared < sigma**2  # (K, n * k)
    entry = _flat_nonzero(reached)
    weight = 1.0 - squared.flatten().index_select(0, entry).clamp_min_(0.0).sqrt_().div_(sigma)
    counts = (
        reached.view(torch.uint8).view(-1, slots).sum(1, dtype=torch.int64)
    )  # as bytes: bools are added slowly
    starts = torch.arange(len(kernel), device=local.device) * (n * slots)
    begin = starts.repeat_interleave(counts.view(len(kernel), n).sum(1))
    return neighbors.flatten().index_select(0, entry - begin), weight, counts


def _flat_nonzero(mask: Tensor) -> Tensor:
    # numpy's is five times as fast as torch's on the CPU
    if mask.is_cuda:
        return mask.flatten().nonzero()[:, 0]
    return torch.from_numpy(np.flatnonzero(mask.numpy()))


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
    bags = F.embedding_bag(
        influence.index, features, influence.offsets, mode="sum", per_sample_weights=influence.weight
    )
    chunks = bags.split(influence.chunk * n_kernel)
    gathered = torch.cat(
        [chunk.view(n_kernel, -1, dim_in).transpose(0, 1) for chunk in chunks]
    )  # (N, K, C_in)
    out = gathered.flatten(1) @ weights.view(n_kernel * dim_in, dim_out)
    out = out / _positive_neighbors(features, neighbors)[:, None]
    return out if bias is None else out + bias


def _positive_neighbors(features: Tensor, neighbors: Tensor) -> Tensor:
    positive = torch.cat([features.detach().sum(1) > 0, neighbors.new_zeros(1, dtype=torch.bool)]).view(
        torch.uint8
    )
    return positive.take(neighbors).sum(1, dtype=torch.int64).clamp_min(1)


class KPConv(nn.Module):
    """A kernel point convolution from ``dim_in`` to ``dim_out`` channels; ``radius``, ``sigma`` in metres."""

    kernel: Tensor

    def __init__(
        self,
        dim_in: int,
        dim_out: int,
        radius: float,
        sigma: float,
        n_kernel: int,
        rng: np.random.Generator | None,
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
        self,
        features: Tensor,
        queries: Tensor,
        supports: Tensor,
        neighbors: Tensor,
        influence: Influence | None = None,
    ) -> Tensor:
        """(M, C_in) to (N, C_out); a stage that shares its kernel points hands ``influence`` in."""
        if influence is None:
            influence = kernel_influence(queries, supports, neighbors, self.kernel, self.sigma)
        return kernel_point_convolution(features, neighbors, influence, self.weights, self.bias)
