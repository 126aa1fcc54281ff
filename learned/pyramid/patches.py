# SPDX-License-Identifier: MIT
"""Patches: every fine point belongs to its nearest superpoint (docs/methods.md 7.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor

from hybridreg.learned.layers.distances import squared_distances

_CHUNK_PAIRS = 2**22


@dataclass(frozen=True)
class Patches:
    """The fine points of each superpoint of one cloud."""

    owner: Tensor  # (N,) int64: the superpoint of each fine point
    index: Tensor  # (n, K) int64 into the fine points, pad N
    mask: Tensor  # (n, K) bool

    @property
    def occupied(self) -> Tensor:
        """(n,) bool: superpoints that own at least one fine point."""
        return self.mask.any(1)


def build_patches(
    points: Tensor, nodes: Tensor, limit: int, rule: Literal["nearest", "first"] = "nearest"
) -> Patches:
    """Assign fine points (N, 3) to superpoints (n, 3) and keep at most ``limit`` of each.

    ``rule`` says which, and in which order: the nearest ones, nearest first, or the first ones by index.
    """
    limit = min(limit, len(points))
    distance, owner = _assign(points, nodes)
    # Sort by superpoint, then by distance: two stable sorts.
    order = distance.argsort(stable=True) if rule == "nearest" else torch.arange(len(points)).to(owner)
    order = order[owner[order].argsort(stable=True)]
    counts = torch.bincount(owner, minlength=len(nodes))
    starts = counts.cumsum(0) - counts
    rank = torch.arange(len(points), device=points.device) - starts[owner[order]]
    index = torch.full((len(nodes), limit), len(points), dtype=torch.int64, device=points.device)
    kept = rank < limit
    index[owner[order[kept]], rank[kept]] = order[kept]
    return Patches(owner, index, index < len(points))


def _assign(points: Tensor, nodes: Tensor) -> tuple[Tensor, Tensor]:
    size = max(1, _CHUNK_PAIRS // len(nodes))
    found = [squared_distances(nodes, block).min(0) for block in points.split(size)]
    return torch.cat([f.values for f in found]), torch.cat([f.indices for f in found])
