# SPDX-License-Identifier: MIT
"""Training targets of RoITr from the true pose."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.targets import node_overlaps
from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.pyramid.neighbors import radius_neighbors
from hybridreg.learned.pyramid.patches import Patches, build_patches
from hybridreg.learned.roitr.batch import RoitrBatch
from hybridreg.learned.roitr.config import RoitrConfig


@dataclass(frozen=True, kw_only=True)
class RoitrTargets:
    """Superpoint pairs whose patches overlap under the true pose, and those drawn for a training step."""

    transform: Tensor  # (4, 4) float32: T_target_source
    target: Tensor  # (G,) int64 superpoints
    source: Tensor  # (G,) int64
    overlap: Tensor  # (G,) in (0, 1]
    drawn: Tensor  # (g,) int64 into the G pairs

    def to(self, device: torch.device | str) -> RoitrTargets:
        """The same targets on another device."""
        return RoitrTargets(**{name: value.to(device) for name, value in vars(self).items()})


def compute_targets(
    batch: RoitrBatch, transform: Tensor, config: RoitrConfig, generator: torch.Generator | None = None
) -> RoitrTargets:
    """Overlaps of all superpoint pairs, and at most ``loss.targets`` random ones with a large overlap.

    Parameters
    ----------
    batch
        The pair.
    transform
        (4, 4) true ``T_target_source``.
    config
        ``matching.matching_radius``, ``matching.patch_points``, ``loss.targets`` and ``target_overlap`` are used.
    generator
        Of the random choice, on the CPU.
    """
    clouds = (batch.target, batch.source)
    transform = transform.to(clouds[0].points[0])
    limit = config.matching.patch_points
    patches = [build_patches(cloud.points[0], cloud.points[-1], limit) for cloud in clouds]
    nodes = (clouds[0].points[-1], apply_transform(clouds[1].points[-1], transform))
    points = (clouds[0].points[0], apply_transform(clouds[1].points[0], transform))
    pairs, overlap = node_overlaps(nodes, points, (patches[0], patches[1]), config.matching.matching_radius)
    worthy = (overlap > config.target_overlap).nonzero()[:, 0]
    if len(worthy) > config.loss.targets:
        order = torch.randperm(len(worthy), generator=generator)[: config.loss.targets]
        worthy = worthy[order.to(worthy.device)]
    return RoitrTargets(transform=transform, target=pairs[0], source=pairs[1], overlap=overlap, drawn=worthy)


def visible_shares(
    points: tuple[Tensor, Tensor], patches: tuple[Patches, Patches], transform: Tensor, radius: float
) -> tuple[Tensor, Tensor]:
    """Share of each superpoint's patch that lies in the overlap: (m,), (n,) in [0, 1].

    The original computes them in every pass as targets of an occlusion loss that is always zero (lib/utils.py,
    get_node_occlusion_score). Here they are only for inspection; no loss uses them.
    """
    moved = apply_transform(points[1], transform)
    near = (_has_near(points[0], moved, radius), _has_near(moved, points[0], radius))
    target, source = (
        (torch.cat([found, found.new_zeros(1)])[patch.index] * patch.mask).sum(1)
        / patch.mask.sum(1).clamp_min(1)
        for found, patch in zip(near, patches, strict=True)
    )
    return target, source


def _has_near(points: Tensor, others: Tensor, radius: float) -> Tensor:
    return (radius_neighbors(points, others, radius, 1)[:, 0] < len(others)).to(points.dtype)
