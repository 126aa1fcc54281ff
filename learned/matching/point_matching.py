# SPDX-License-Identifier: MIT
"""From assignments of patch pairs to point correspondences (docs/methods.md 8.5)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.config import MatchingConfig
from hybridreg.learned.matching.patch_pairs import PatchPairs


@dataclass(frozen=True)
class PointMatches:
    """Point correspondences grouped by patch pair; groups ascend."""

    target: Tensor  # (C, 3) metres
    source: Tensor  # (C, 3) metres
    weight: Tensor  # (C,) in (0, 1]
    group: Tensor  # (C,) int64: the patch pair
    target_index: Tensor  # (C,) int64: fine points of the target
    source_index: Tensor  # (C,) int64

    def __len__(self) -> int:
        return len(self.weight)

    def only(self, chosen: Tensor) -> PointMatches:
        """The matches of a mask (C,), or all where it leaves none."""
        if not bool(chosen.any()):
            return self
        return PointMatches(*(getattr(self, name)[chosen] for name in PointMatches.__dataclass_fields__))


def mutual_top_k(
    probability: Tensor, rows: Tensor, columns: Tensor, *, topk: int, threshold: float, mutual: bool = True
) -> Tensor:
    """Which entries (B, n, m) are among the ``topk`` of their row and column, above ``threshold`` and valid.

    With ``mutual`` false the row or the column suffices.
    """
    by_row = _among_top(probability, topk, 2)
    by_column = _among_top(probability, topk, 1)
    chosen = (by_row & by_column) if mutual else (by_row | by_column)
    return chosen & (probability > threshold) & rows[:, :, None] & columns[:, None, :]


def _among_top(probability: Tensor, topk: int, dim: int) -> Tensor:
    index = probability.topk(min(topk, probability.shape[dim]), dim=dim).indices
    return torch.zeros_like(probability, dtype=torch.bool).scatter_(dim, index, True)


def gather_matches(
    blocks: list[tuple[PatchPairs, Tensor]], target: Tensor, source: Tensor, config: MatchingConfig
) -> PointMatches:
    """Correspondences of all assigned pairs (docs/methods.md 8.5).

    Parameters
    ----------
    blocks
        Pairs with their log-assignments (B, n + 1, m + 1).
    target, source
        (N, 3), (M, 3) fine points in metres.
    config
        ``topk``, ``confidence``, ``mutual``. When nothing passes, the threshold falls to 0.01; then mutual
        best matches are taken without a threshold.
    """
    strict = (config.topk, config.confidence, config.mutual)
    for topk, threshold, mutual in (
        strict,
        (config.topk, min(config.confidence, 0.01), config.mutual),
        (1, 0.0, True),
    ):
        found = [
            _matches_of(pairs, assignment, target, source, topk=topk, threshold=threshold, mutual=mutual)
            for pairs, assignment in blocks
        ]
        if sum(len(matches) for matches in found):
            break
    return _join(found, target)


def _matches_of(
    pairs: PatchPairs,
    assignment: Tensor,
    target: Tensor,
    source: Tensor,
    *,
    topk: int,
    threshold: float,
    mutual: bool,
) -> PointMatches:
    probability = assignment[:, :-1, :-1].exp()
    chosen = mutual_top_k(
        probability, pairs.target_mask, pairs.source_mask, topk=topk, threshold=threshold, mutual=mutual
    )
    pair, row, column = chosen.nonzero(as_tuple=True)
    target_index, source_index = pairs.target_index[pair, row], pairs.source_index[pair, column]
    return PointMatches(
        target[target_index],
        source[source_index],
        probability[chosen],
        pairs.group[pair],
        target_index,
        source_index,
    )


def _join(found: list[PointMatches], like: Tensor) -> PointMatches:
    if not found:
        none, index = like.new_zeros(0, 3), torch.zeros(0, dtype=torch.int64, device=like.device)
        return PointMatches(none, none, like.new_zeros(0), index, index, index)
    group = torch.cat([matches.group for matches in found])
    order = group.argsort(stable=True)

    def column(name: str) -> Tensor:
        return torch.cat([getattr(matches, name) for matches in found])[order]

    names = ("target", "source", "weight", "group", "target_index", "source_index")
    return PointMatches(*(column(name) for name in names))
