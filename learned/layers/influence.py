# SPDX-License-Identifier: MIT
"""Influence of the neighbours on the kernel points: the sparse geometry of a KPConv (docs/methods.md 3.2)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import torch
from torch import Tensor

from hybridreg.learned.layers.sparse_rows import Bags


@dataclass(frozen=True)
class Links:
    """The neighbours of all queries without padding, query after query; shared by all layers of a stage."""

    n_queries: int
    n_supports: int
    query: Tensor  # (E,) int64
    support: Tensor  # (E,) int64
    local: Tensor  # (4, E): support minus query in metres, and its squared length
    exact: bool = (
        False  # subtract kernel points before squaring: a quarter of the rounding, for a little more time
    )

    def influence(self, kernel: Tensor, sigma: float) -> Influence:
        """Of every neighbour on every kernel point (K, 3) metres: ``max(0, 1 - |y_j - q_i - x_k| / sigma)``."""
        # |a - x|^2 as |a|^2 - 2 a.x + |x|^2: one product, no (E, K, 3) tensor. One kernel point at a time, so that the
        # data stays in the cache.
        factors = torch.cat([-2.0 * kernel, torch.ones_like(kernel[:, :1])], dim=1)
        constants = kernel.square().sum(1).tolist()
        parts = [
            _reached(self, factor, constant, sigma)
            for factor, constant in zip(factors, constants, strict=True)
        ]
        return Influence(tuple(parts))


def find_links(
    queries: Tensor, supports: Tensor, neighbors: Tensor, *, cylindrical: bool = False, exact: bool = False
) -> Links:
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
        len(queries),
        len(supports),
        query,
        support,
        torch.cat([local, local.square().sum(0, keepdim=True)]),
        exact,
    )


@dataclass(frozen=True)
class Influence:
    """The non-zero influences of a layer: for each kernel point, one bag of supports a query.

    Only about a tenth of all (kernel point, query, neighbour) triples lie within the kernel points' influence radius:
    the sparse form does a tenth of the multiplications of the dense one.
    """

    bags: tuple[Bags, ...]  # of each kernel point: (N, M)

    def convolve(self, features: Tensor, weights: Tensor) -> Tensor:
        """``sum_k H_k F W_k``: (M, C_in) and (K, C_in, C_out) to (N, C_out)."""
        total: Tensor = _WeightedSums.apply(features, weights, self)
        return total

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


class _WeightedSums(torch.autograd.Function):
    # Kernel point by kernel point.

    @staticmethod
    def forward(ctx: Any, features: Tensor, weights: Tensor, influence: Influence) -> Tensor:
        ctx.influence = influence
        kept = []
        out = features.new_zeros(len(influence.bags[0].offsets), weights.shape[2])
        for bags, weight in zip(influence.bags, weights, strict=True):
            gathered = bags.sum_detached(features)
            out.addmm_(gathered, weight)
            if ctx.needs_input_grad[1]:
                kept.append(gathered)
        ctx.save_for_backward(weights, *kept)
        return out

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, Tensor | None, None]:
        weights, *kept = ctx.saved_tensors
        of_features = of_weights = None
        if ctx.needs_input_grad[0]:
            # all kernel points in one product and one sum
            n_kernel, dim_in, dim_out = weights.shape
            flat = gradient @ weights.view(n_kernel * dim_in, dim_out).t()
            of_features = ctx.influence.transposed.sum_detached(flat.view(-1, dim_in))
        if ctx.needs_input_grad[1]:
            of_weights = torch.stack([gathered.t() @ gradient for gathered in kept])
        return of_features, of_weights, None


def _reached(links: Links, factor: Tensor, constant: float, sigma: float) -> Bags:
    squared = factor @ links.local
    entry = _positions(squared, sigma**2 - constant)
    if links.exact:
        offset = links.local[:3].index_select(1, entry) + factor[:3, None] / 2.0
        # torch's norm over an axis of three takes forty times as long on the CPU.
        distance = offset.square().sum(0).sqrt_().clamp_max_(sigma)
    else:
        distance = (squared.index_select(0, entry) + constant).clamp_min_(0.0).sqrt_()
    counts = torch.bincount(links.query.index_select(0, entry), minlength=links.n_queries)
    support = links.support.index_select(0, entry)
    return Bags(support, 1.0 - distance / sigma, counts.cumsum(0) - counts, links.n_supports)


def _positions(values: Tensor, limit: float) -> Tensor:
    """Positions where a vector is below the limit."""
    # numpy compares ten times as fast as torch on the CPU, and finds the true ones five times as fast
    if values.device.type == "cpu":
        return torch.from_numpy(np.flatnonzero(values.numpy() < limit))
    return (values < limit).nonzero()[:, 0]
