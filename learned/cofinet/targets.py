# SPDX-License-Identifier: MIT
"""Training targets of both transports from the true pose, and the pairs that a step draws."""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor
from torch.nn import functional as F

from hybridreg.learned.cofinet.config import CofinetConfig
from hybridreg.learned.cofinet.patching import PatchIndex, patch_index
from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.pyramid.neighbors import pairs_within
from hybridreg.learned.pyramid.patches import build_patches
from hybridreg.learned.pyramid.point_pyramid import Pyramid


@dataclass(frozen=True, kw_only=True)
class CofinetTargets:
    """Weights of both losses. Rows are the source's, columns the target's, the last of each the slack."""

    coarse: Tensor  # (n + 1, m + 1) of the superpoints
    drawn: Tensor  # (B, 2) int64: pairs of superpoints, source and target
    patches: tuple[PatchIndex, PatchIndex]  # of the drawn pairs, source and target: B patches each
    fine: Tensor  # (B, P + 1, P + 1), 0 or 1

    def to(self, device: torch.device | str) -> CofinetTargets:
        """The same targets on another device."""
        source, target = (PatchIndex(each.index.to(device), each.mask.to(device)) for each in self.patches)
        moved = {name: getattr(self, name).to(device) for name in ("coarse", "drawn", "fine")}
        return replace(self, **moved, patches=(source, target))


def compute_targets(
    pyramid: Pyramid, transform: Tensor, config: CofinetConfig, generator: torch.Generator
) -> CofinetTargets:
    """Targets of a pair, and one sample of true superpoint pairs, with replacement; empty where there are none.

    Parameters
    ----------
    pyramid
        Of the pair.
    transform
        (4, 4) true ``T_target_source``.
    generator
        On the CPU.
    """
    target, source = pyramid.clouds(0)
    moved = apply_transform(source, transform.to(source))
    nodes = pyramid.clouds(pyramid.stages - 1)
    owners = [build_patches(points, at, 1).owner for points, at in zip((target, source), nodes, strict=True)]
    pairs = pairs_within(moved, target, config.loss.overlap_radius)
    coarse = node_weights(
        pairs, (owners[1], owners[0]), (len(nodes[1]), len(nodes[0])), config.loss.min_overlap
    )
    true = true_pairs(coarse)
    chosen = torch.randint(max(1, len(true)), (config.loss.pairs,), generator=generator)
    drawn = true[chosen.to(true.device)] if len(true) else true
    patches = training_patches(pyramid, config)
    return with_pairs(coarse, drawn, patches, (moved, target), config)


def training_patches(pyramid: Pyramid, config: CofinetConfig) -> tuple[PatchIndex, PatchIndex]:
    """Patches of all superpoints of source and target, of the size that training has."""
    nodes, points = pyramid.clouds(pyramid.stages - 1), pyramid.clouds(0)
    target, source = (
        patch_index(points[side], nodes[side], config.loss.patch_points, config.patch_rule) for side in (0, 1)
    )
    return source, target


def with_pairs(
    coarse: Tensor,
    drawn: Tensor,
    patches: tuple[PatchIndex, PatchIndex],
    points: tuple[Tensor, Tensor],
    config: CofinetConfig,
) -> CofinetTargets:
    """Targets of drawn pairs (B, 2) of superpoints; points (N, 3), (M, 3) of source and target in one frame."""
    sides = (patches[0].take(drawn[:, 0]), patches[1].take(drawn[:, 1]))
    fine = fine_truth(sides, points, config.loss.fine_radius, released=config.padding == "point0")
    return CofinetTargets(coarse=coarse, drawn=drawn, patches=sides, fine=fine)


def node_weights(
    pairs: tuple[Tensor, Tensor], owners: tuple[Tensor, Tensor], counts: tuple[int, int], min_overlap: float
) -> Tensor:
    """(n + 1, m + 1): how much of two superpoints' points coincides, and the share of each without correspondence.

    The weight of a pair is the smaller of two products, one a side: the share of the superpoint's point pairs that go
    to the other one, times the share of its points with any correspondence. Point pairs are counted, so dense places
    count more than once. Weights up to ``min_overlap`` become 0; the slack is left unchanged.

    Parameters
    ----------
    pairs
        (P,), (P,) rows of source and target points that coincide.
    owners
        (N,), (M,) superpoint of each point.
    counts
        Superpoints of source and target.
    """
    shared = torch.zeros(counts, device=owners[0].device)
    ones = torch.ones(len(pairs[0]), device=shared.device)
    shared.index_put_((owners[0][pairs[0]], owners[1][pairs[1]]), ones, accumulate=True)
    seen = [_seen(rows, owner, count) for rows, owner, count in zip(pairs, owners, counts, strict=True)]
    by_row = shared / shared.sum(1, keepdim=True).clamp_min(1.0) * seen[0][:, None]
    by_column = shared / shared.sum(0, keepdim=True).clamp_min(1.0) * seen[1][None]
    weights = F.pad(torch.minimum(by_row, by_column), (0, 1, 0, 1))
    weights = weights * (weights > min_overlap)
    weights[:-1, -1], weights[-1, :-1] = 1.0 - seen[0], 1.0 - seen[1]
    return weights


def _seen(rows: Tensor, owner: Tensor, count: int) -> Tensor:
    has_partner = torch.zeros(len(owner), device=owner.device)
    has_partner[rows] = 1.0
    total = torch.zeros(count, device=owner.device).index_add_(0, owner, torch.ones_like(has_partner))
    return torch.zeros_like(total).index_add_(0, owner, has_partner) / total.clamp_min(1.0)


def true_pairs(coarse: Tensor) -> Tensor:
    """(K, 2) pairs of superpoints, source and target, of weights (n + 1, m + 1)."""
    return (coarse[:-1, :-1] > 0).nonzero()


def fine_truth(
    patches: tuple[PatchIndex, PatchIndex],
    points: tuple[Tensor, Tensor],
    radius: float,
    *,
    released: bool,
) -> Tensor:
    """(B, P + 1, P + 1): 1 for points nearer than the radius (m), and in the slack for points without a correspondence.

    As ``released``, point 0 in the empty slots counts as a correspondence: a point near nothing else then has no label.
    """
    source, target = points[0][patches[0].filled], points[1][patches[1].filled]
    near = torch.cdist(source, target, compute_mode="donot_use_mm_for_euclid_dist") < radius
    valid = patches[0].mask[:, :, None] & patches[1].mask[:, None]
    partners = near if released else near & valid
    truth = F.pad(near & valid, (0, 1, 0, 1))
    truth[:, :-1, -1] = ~partners.any(2) & patches[0].mask
    truth[:, -1, :-1] = ~partners.any(1) & patches[1].mask
    return truth.to(points[0].dtype)
