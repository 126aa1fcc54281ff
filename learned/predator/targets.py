# SPDX-License-Identifier: MIT
"""Training targets: corresponding points of a pair under the true pose, and the sample of a step."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.predator.config import PredatorConfig, PredatorLossConfig
from hybridreg.learned.pyramid.neighbors import pairs_within
from hybridreg.learned.pyramid.point_pyramid import Pyramid


@dataclass(frozen=True, kw_only=True)
class PredatorTargets:
    """Rows count in each cloud's points of the first stage."""

    transform: Tensor  # (4, 4) float32: T_target_source
    source: Tensor  # (P,) int64: with ``target`` all pairs nearer than the overlap radius
    target: Tensor  # (P,) int64
    drawn_source: Tensor  # (D,) int64: the pairs of the circle loss
    drawn_target: Tensor  # (D,) int64

    def to(self, device: torch.device | str) -> PredatorTargets:
        """The same targets on another device."""
        names = ("transform", "source", "target", "drawn_source", "drawn_target")
        return PredatorTargets(**{name: getattr(self, name).to(device) for name in names})


def compute_targets(
    pyramid: Pyramid, transform: Tensor, config: PredatorConfig, generator: torch.Generator
) -> PredatorTargets:
    """All true point pairs, and one sample of them for the circle loss.

    The published training drops pairs of clouds with fewer than ``max_points`` true pairs; here they give what they
    have, even none.

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
    transform = transform.to(target)
    moved = apply_transform(source, transform)
    pairs = pairs_within(moved, target, config.loss.overlap_radius)
    near = candidates(moved, target, pairs, config.loss)
    order = torch.randperm(len(near), generator=generator)[: config.loss.max_points]
    drawn = near[order.to(near.device)]
    return PredatorTargets(
        transform=transform,
        source=pairs[0],
        target=pairs[1],
        drawn_source=pairs[0][drawn],
        drawn_target=pairs[1][drawn],
    )


def candidates(
    source: Tensor, target: Tensor, pairs: tuple[Tensor, Tensor], config: PredatorLossConfig
) -> Tensor:
    """Which of the pairs (P,) of points (N, 3), (M, 3) of one frame are near enough for the circle loss."""
    distance = (source[pairs[0]] - target[pairs[1]]).norm(dim=1)
    return (distance < config.positive_radius - config.positive_slack).nonzero()[:, 0]
