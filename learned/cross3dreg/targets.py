# SPDX-License-Identifier: MIT
"""Training targets from the true pose: patch overlaps and the true mask (docs/methods.md 5.2, 7.2)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.config import NetworkConfig
from hybridreg.learned.layers.distances import squared_distances
from hybridreg.learned.layers.kpconv_blocks import pad_row
from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.pyramid.patches import Patches, build_patches
from hybridreg.learned.pyramid.point_pyramid import Pyramid

_CHUNK_VALUES = 2**23
_FAR = 1e12


@dataclass(frozen=True, kw_only=True)
class Targets:
    """Superpoint pairs whose patches overlap under the true pose, and the mask that follows from them."""

    transform: Tensor  # (4, 4) float32: T_target_source
    target: Tensor  # (G,) int64 superpoints
    source: Tensor  # (G,) int64
    overlap: Tensor  # (G,) in (0, 1]
    mask_target: Tensor  # (m,) bool: superpoints in the overlap
    mask_source: Tensor  # (n,) bool


def compute_targets(pyramid: Pyramid, transform: Tensor, config: NetworkConfig) -> Targets:
    """Overlaps of all superpoint pairs.

    Parameters
    ----------
    pyramid
        Of the pair.
    transform
        (4, 4) true ``T_target_source``.
    config
        ``matching.matching_radius``, ``matching.patch_points``, ``loss.mask_overlap`` are used.
    """
    transform = transform.to(pyramid.points[0])
    nodes = pyramid.clouds(pyramid.stages - 1)
    points = pyramid.clouds(config.backbone.fine_stage - 1)
    limit = config.matching.patch_points
    patches = (build_patches(points[0], nodes[0], limit), build_patches(points[1], nodes[1], limit))
    moved_nodes = (nodes[0], apply_transform(nodes[1], transform))
    moved_points = (points[0], apply_transform(points[1], transform))
    pairs, overlap = node_overlaps(moved_nodes, moved_points, patches, config.matching.matching_radius)
    best = [torch.zeros(len(cloud), device=overlap.device) for cloud in nodes]
    for side in (0, 1):
        best[side].scatter_reduce_(0, pairs[side], overlap, "amax")
    return Targets(
        transform=transform,
        target=pairs[0],
        source=pairs[1],
        overlap=overlap,
        mask_target=best[0] > config.loss.mask_overlap,
        mask_source=best[1] > config.loss.mask_overlap,
    )


def node_overlaps(
    nodes: tuple[Tensor, Tensor],
    points: tuple[Tensor, Tensor],
    patches: tuple[Patches, Patches],
    radius: float,
) -> tuple[tuple[Tensor, Tensor], Tensor]:
    """Superpoint pairs with ``o_ij > 0``, row by row, and ``o_ij``.

    ``o_ij`` is the mean of two shares: the points of patch i with a point of patch j within the radius,
    and the other way round. All points must be in one frame.
    """
    pair_target, pair_source = _candidates(nodes, points, patches, radius)
    size = max(1, _CHUNK_VALUES // (patches[0].mask.shape[1] * patches[1].mask.shape[1]))
    padded = (pad_row(points[0]), pad_row(points[1]))
    shares = [
        _overlap_of(padded, patches, i, j, radius)
        for i, j in zip(pair_target.split(size), pair_source.split(size), strict=True)
    ]
    overlap = torch.cat(shares)
    found = overlap > 0
    return (pair_target[found], pair_source[found]), overlap[found]


def _candidates(
    nodes: tuple[Tensor, Tensor],
    points: tuple[Tensor, Tensor],
    patches: tuple[Patches, Patches],
    radius: float,
) -> tuple[Tensor, Tensor]:
    # Two patches can only overlap where their bounding balls do.
    reach = [_reach(nodes[side], points[side], patches[side]) for side in (0, 1)]
    distance = squared_distances(nodes[0], nodes[1]).sqrt()
    near = reach[0][:, None] + reach[1][None] + radius > distance
    near &= patches[0].occupied[:, None] & patches[1].occupied[None]
    target, source = near.nonzero(as_tuple=True)
    return target, source


def _reach(nodes: Tensor, points: Tensor, patches: Patches) -> Tensor:
    distance = (pad_row(points)[patches.index] - nodes[:, None]).norm(dim=-1)
    return distance.masked_fill(~patches.mask, 0.0).amax(1)


def _overlap_of(
    points: tuple[Tensor, Tensor],
    patches: tuple[Patches, Patches],
    target: Tensor,
    source: Tensor,
    radius: float,
) -> Tensor:
    mask_target, mask_source = patches[0].mask[target], patches[1].mask[source]
    squared = squared_distances(points[0][patches[0].index[target]], points[1][patches[1].index[source]])
    squared = squared.masked_fill(~(mask_target[:, :, None] & mask_source[:, None]), _FAR)
    near = squared < radius**2
    share_target = near.any(2).sum(1) / mask_target.sum(1)
    share_source = near.any(1).sum(1) / mask_source.sum(1)
    return (share_target + share_source) / 2
