# SPDX-License-Identifier: MIT
"""Pairs of patches: the padded fine points to be assigned, and groups of pairs of similar size."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.pyramid.patches import Patches

# Values of one chunk's score matrices: half a megabyte fits the second-level cache.
_CHUNK_VALUES = 2**17


@dataclass(frozen=True)
class PatchPairs:
    """B pairs of patches, rows the target's points and columns the source's."""

    target_index: Tensor  # (B, n) int64 into the target's fine points, pad their number
    target_mask: Tensor  # (B, n) bool
    source_index: Tensor  # (B, m) int64
    source_mask: Tensor  # (B, m) bool
    group: Tensor  # (B,) int64: the pair's index among all pairs

    def __len__(self) -> int:
        return len(self.group)

    def take(self, pairs: Tensor, n: int | None = None, m: int | None = None) -> PatchPairs:
        """Some of the pairs, cut to n rows and m columns."""
        return PatchPairs(
            self.target_index[pairs, :n],
            self.target_mask[pairs, :n],
            self.source_index[pairs, :m],
            self.source_mask[pairs, :m],
            self.group[pairs],
        )


def pair_patches(target: Patches, source: Patches, target_nodes: Tensor, source_nodes: Tensor) -> PatchPairs:
    """The patches of superpoints (B,), (B,) side by side; all must own fine points."""
    return PatchPairs(
        target.index[target_nodes],
        target.mask[target_nodes],
        source.index[source_nodes],
        source.mask[source_nodes],
        torch.arange(len(target_nodes), device=target_nodes.device),
    )


def size_chunks(pairs: PatchPairs) -> list[PatchPairs]:
    """The pairs sorted by size, in chunks cut to the largest pair of each: so that little padding is computed."""
    if len(pairs) == 0:
        return []
    n_rows, n_columns = pairs.target_mask.sum(1), pairs.source_mask.sum(1)
    order = (n_rows * n_columns).argsort(stable=True)
    chunks: list[PatchPairs] = []
    start, n, m = 0, 0, 0
    for end, (height, width) in enumerate(torch.stack([n_rows, n_columns], 1)[order].tolist()):
        grown = (end + 1 - start) * (max(n, height) + 1) * (max(m, width) + 1)
        if grown > _CHUNK_VALUES and end > start:
            chunks.append(pairs.take(order[start:end], n, m))
            start, n, m = end, 0, 0
        n, m = max(n, height), max(m, width)
    return [*chunks, pairs.take(order[start:], n, m)]
