# SPDX-License-Identifier: MIT
"""Which neighbours reach which kernel points, and how strongly: the geometry of a KPConv (methods 3.2)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from scipy.sparse import csr_array
from torch import Tensor


@dataclass(frozen=True)
class Links:
    """The neighbours of all queries without the shadows, query after query; all layers of a stage share it."""

    n_queries: int
    n_supports: int
    query: Tensor  # (E,) int64
    support: Tensor  # (E,) int64
    local: Tensor  # (4, E): support minus query in metres, and its squared length


def find_links(queries: Tensor, supports: Tensor, neighbors: Tensor) -> Links:
    """Links of queries (N, 3) to supports (M, 3) by neighbours (N, k) int64, pad M."""
    entry = _positions(neighbors.flatten(), len(supports))
    query = entry.div(max(1, neighbors.shape[1]), rounding_mode="floor")
    support = neighbors.flatten().index_select(0, entry)
    local = (supports.index_select(0, support) - queries.index_select(0, query)).t()
    return Links(
        len(queries), len(supports), query, support, torch.cat([local, local.square().sum(0, keepdim=True)])
    )


@dataclass(frozen=True)
class Influence:
    """The non-zero influences of a layer, kernel point after kernel point, one bag for each query.

    Only about a tenth of all (kernel point, query, neighbour) triples lie within the kernel points' reach:
    the sparse form does a tenth of the multiplications of the dense one.
    """

    n_supports: int
    support: tuple[Tensor, ...]  # of each kernel point: (E_k,) int64
    weight: tuple[Tensor, ...]  # (E_k,) in (0, 1]
    offsets: tuple[Tensor, ...]  # (N,) int64: where the bag of each query begins

    @cached_property
    def transposed(self) -> tuple[Tensor, Tensor, Tensor]:
        """By support: ``query * K + kernel point`` (E,), weight (E,), and where each support begins (M,)."""
        n_kernel, n = len(self.support), len(self.offsets[0])
        starts, total = [], 0
        for support, offsets in zip(self.support, self.offsets, strict=True):
            starts.append(offsets + total)
            total += len(support)
        starts.append(starts[0].new_full((1,), total))
        table = csr_array(
            (
                torch.cat(self.weight).numpy(force=True),
                torch.cat(self.support).numpy(force=True),
                torch.cat(starts).numpy(force=True),
            ),
            shape=(n_kernel * n, self.n_supports),
        ).tocsc()
        device = starts[0].device
        bag = torch.from_numpy(table.indices.astype(np.int64)).to(device)
        return (
            bag % n * n_kernel + bag.div(n, rounding_mode="floor"),
            torch.from_numpy(table.data).to(device),
            torch.from_numpy(table.indptr[:-1].astype(np.int64)).to(device),
        )


def kernel_influence(links: Links, kernel: Tensor, sigma: float) -> Influence:
    """Linear influence ``max(0, 1 - |y_j - q_i - x_k| / sigma)`` of every neighbour on every kernel point.

    Parameters
    ----------
    links
        Of the queries.
    kernel
        (K, 3) metres.
    sigma
        Reach in metres.
    """
    # |a - x|^2 as |a|^2 - 2 a.x + |x|^2: one product, no (E, K, 3) tensor. One kernel point at a time, so that
    # what is looked at stays in the cache.
    factors = torch.cat([-2.0 * kernel, torch.ones_like(kernel[:, :1])], dim=1)
    constants = kernel.square().sum(1)
    parts = [
        _reached(links, factor, float(constant), sigma)
        for factor, constant in zip(factors, constants, strict=True)
    ]
    support, weight, offsets = zip(*parts, strict=True)
    return Influence(links.n_supports, support, weight, offsets)


def _reached(links: Links, factor: Tensor, constant: float, sigma: float) -> tuple[Tensor, Tensor, Tensor]:
    squared = factor @ links.local
    entry = _positions(squared, sigma**2 - constant)
    distance = (squared.index_select(0, entry) + constant).clamp_min_(0.0).sqrt_()
    counts = torch.bincount(links.query.index_select(0, entry), minlength=links.n_queries)
    return links.support.index_select(0, entry), 1.0 - distance / sigma, counts.cumsum(0) - counts


def _positions(values: Tensor, limit: float) -> Tensor:
    """Where a vector is below the limit."""
    # numpy compares ten times as fast as torch on the CPU, and finds the true ones five times as fast
    if values.device.type == "cpu":
        return torch.from_numpy(np.flatnonzero(values.numpy() < limit))
    return (values < limit).nonzero()[:, 0]
