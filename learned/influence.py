# SPDX-License-Identifier: MIT
"""Which neighbours reach which kernel points, and how strongly: the geometry of a KPConv (methods 3.2)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from hybridreg.learned.bags import Bags


@dataclass(frozen=True)
class Links:
    """The neighbours of all queries without the shadows, query after query; all layers of a stage share it."""

    n_queries: int
    n_supports: int
    query: Tensor  # (E,) int64
    support: Tensor  # (E,) int64
    local: Tensor  # (4, E): support minus query in metres, and its squared length


def find_links(queries: Tensor, supports: Tensor, neighbors: Tensor, *, cylindrical: bool = False) -> Links:
    """Links of queries (N, 3) to supports (M, 3) by neighbours (N, k) int64, pad M.

    ``cylindrical`` folds each offset about the vertical axis, (x, y, z) to (sqrt(x^2 + y^2), 0, z).
    """
    entry = _positions(neighbors.flatten(), len(supports))
    query = entry.div(max(1, neighbors.shape[1]), rounding_mode="floor")
    support = neighbors.flatten().index_select(0, entry)
    local = (supports.index_select(0, support) - queries.index_select(0, query)).t()
    if cylindrical:
        local = torch.stack([local[:2].norm(dim=0), torch.zeros_like(local[2]), local[2]])
    return Links(
        len(queries), len(supports), query, support, torch.cat([local, local.square().sum(0, keepdim=True)])
    )


@dataclass(frozen=True)
class Influence:
    """The non-zero influences of a layer: for each kernel point, one bag of supports a query.

    Only about a tenth of all (kernel point, query, neighbour) triples lie within the kernel points' reach:
    the sparse form does a tenth of the multiplications of the dense one.
    """

    bags: tuple[Bags, ...]  # of each kernel point: (N, M)

    @cached_property
    def transposed(self) -> Bags:
        """All kernel points by support: (M, N * K), row ``query * K + kernel point``."""
        n_kernel, n = len(self.bags), len(self.bags[0].offsets)
        lengths = torch.tensor([0, *(len(bag.index) for bag in self.bags[:-1])]).cumsum(0).tolist()
        flipped = Bags(
            torch.cat([bag.index for bag in self.bags]),
            torch.cat([bag.weight for bag in self.bags]),
            torch.cat([bag.offsets + start for bag, start in zip(self.bags, lengths, strict=True)]),
            self.bags[0].n_rows,
        ).transposed
        row = flipped.index % n * n_kernel + flipped.index.div(n, rounding_mode="floor")
        return replace(flipped, index=row)


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
    constants = kernel.square().sum(1).tolist()
    parts = [
        _reached(links, factor, constant, sigma) for factor, constant in zip(factors, constants, strict=True)
    ]
    return Influence(tuple(parts))


def _reached(links: Links, factor: Tensor, constant: float, sigma: float) -> Bags:
    squared = factor @ links.local
    entry = _positions(squared, sigma**2 - constant)
    distance = (squared.index_select(0, entry) + constant).clamp_min_(0.0).sqrt_()
    counts = torch.bincount(links.query.index_select(0, entry), minlength=links.n_queries)
    support = links.support.index_select(0, entry)
    return Bags(support, 1.0 - distance / sigma, counts.cumsum(0) - counts, links.n_supports)


def _positions(values: Tensor, limit: float) -> Tensor:
    """Where a vector is below the limit."""
    # numpy compares ten times as fast as torch on the CPU, and finds the true ones five times as fast
    if values.device.type == "cpu":
        return torch.from_numpy(np.flatnonzero(values.numpy() < limit))
    return (values < limit).nonzero()[:, 0]
