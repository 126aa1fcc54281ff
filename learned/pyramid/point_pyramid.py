# SPDX-License-Identifier: MIT
"""The point pyramid of a pair: points, neighbours and links of every stage, target first (docs/methods.md 2.4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor

from hybridreg.learned.pyramid.grid_subsample import grid_subsample
from hybridreg.learned.pyramid.neighbors import count_neighbors, nearest_neighbor, radius_neighbors


class PyramidPlan(Protocol):
    """What a pyramid needs of a backbone's configuration."""

    @property
    def stages(self) -> int:
        """Number of stages."""

    @property
    def voxel(self) -> float:
        """Edge (m) of the first stage's cells; it doubles with each stage."""

    @property
    def neighbor_limits(self) -> tuple[int, ...]:
        """Most neighbours of a point, one number a stage."""

    def radius(self, stage: int) -> float:
        """Search radius (m) of a stage counted from 0."""


@dataclass(frozen=True, kw_only=True)
class Pyramid:
    """Both clouds stacked, target first, at every stage; neighbours never cross clouds.

    `hybridreg.learned.pyramid.packed` stacks those of several pairs.
    """

    points: tuple[Tensor, ...]  # stage s: (N_s, 3) float32, metres
    lengths: tuple[tuple[int, ...], ...]  # stage s: points of each cloud
    neighbors: tuple[Tensor, ...]  # stage s: (N_s, k_s) int64 into stage s, pad N_s
    subsampling: tuple[Tensor, ...]  # stage s+1's points: (N_{s+1}, k_s) int64 into stage s, pad N_s
    upsampling: tuple[Tensor, ...]  # stage s: (N_s,) int64, the nearest point of stage s+1, or pad N_{s+1}

    @property
    def stages(self) -> int:
        """Number of stages."""
        return len(self.points)

    def to(self, device: torch.device | str) -> Pyramid:
        """The same pyramid on another device."""

        def move(tensors: tuple[Tensor, ...]) -> tuple[Tensor, ...]:
            return tuple(t.to(device) for t in tensors)

        return Pyramid(
            points=move(self.points),
            lengths=self.lengths,
            neighbors=move(self.neighbors),
            subsampling=move(self.subsampling),
            upsampling=move(self.upsampling),
        )

    def clouds(self, stage: int) -> tuple[Tensor, Tensor]:
        """Points (n, 3) of the target and of the source of one pair at a stage counted from 0."""
        target, source = self.points[stage].split(list(self.lengths[stage]))
        return target, source


def build_pyramid(target: Tensor, source: Tensor, config: PyramidPlan, *, subsample: bool = False) -> Pyramid:
    """Subsample both clouds stage by stage and search all neighbours.

    Parameters
    ----------
    target, source
        (M, 3), (N, 3) float32, metres. On a GPU the searches run there.
    config
        Stages, voxel, radii, limits.
    subsample
        Put the clouds on the first stage's grid too; leave false when they already are.

    Raises
    ------
    ValueError
        A cloud has no points.
    """
    for name, cloud in (("target", target), ("source", source)):
        if cloud.shape[0] == 0:
            raise ValueError(f"the {name} cloud has 0 points: give at least one")
    levels = [_levels(cloud, config, subsample) for cloud in (target, source)]
    stages = range(config.stages)
    radius, limit = config.radius, config.neighbor_limits
    return Pyramid(
        points=tuple(torch.cat([level[s] for level in levels]) for s in stages),
        lengths=tuple((len(levels[0][s]), len(levels[1][s])) for s in stages),
        neighbors=tuple(_stack([(c[s], c[s]) for c in levels], radius(s), limit[s]) for s in stages),
        subsampling=tuple(
            _stack([(c[s + 1], c[s]) for c in levels], radius(s), limit[s]) for s in stages[:-1]
        ),
        upsampling=tuple(_stack_nearest([(c[s], c[s + 1]) for c in levels]) for s in stages[:-1]),
    )


def calibrate_neighbor_limits(
    pairs: list[tuple[Tensor, Tensor]], config: PyramidPlan, *, share: float = 0.8
) -> tuple[int, ...]:
    """The neighbour count that ``share`` of the points do not exceed, one integer a stage (docs/methods.md 2.3)."""
    counts: list[list[Tensor]] = [[] for _ in range(config.stages)]
    for pair in pairs:
        for cloud in pair:
            for stage, points in enumerate(_levels(cloud, config, subsample=True)):
                counts[stage].append(count_neighbors(points, points, config.radius(stage)))
    return tuple(max(1, int(torch.cat(c).double().quantile(share))) for c in counts)


def _levels(points: Tensor, config: PyramidPlan, subsample: bool) -> list[Tensor]:
    levels = [grid_subsample(points, config.voxel) if subsample else points]
    for stage in range(1, config.stages):
        levels.append(grid_subsample(levels[-1], config.voxel * 2**stage))
    return levels


def _stack(clouds: list[tuple[Tensor, Tensor]], radius: float, limit: int) -> Tensor:
    total = sum(len(supports) for _, supports in clouds)
    blocks, offset = [], 0
    for queries, supports in clouds:
        index = radius_neighbors(queries, supports, radius, limit)
        blocks.append(torch.where(index < len(supports), index + offset, total))
        offset += len(supports)
    return torch.cat(blocks)


def _stack_nearest(clouds: list[tuple[Tensor, Tensor]]) -> Tensor:
    # Unconditional: equal to the original's radius search whenever that finds anything, and never padding.
    blocks, offset = [], 0
    for queries, supports in clouds:
        blocks.append(nearest_neighbor(queries, supports) + offset)
        offset += len(supports)
    return torch.cat(blocks)
