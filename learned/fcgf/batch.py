# SPDX-License-Identifier: MIT
"""The input of FCGF: the voxels of both clouds, of one pair or of several. No ground truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from hybridreg.learned.fcgf.config import FcgfConfig
from hybridreg.learned.layers.voxels import VoxelPyramid, quantise


@dataclass(frozen=True, kw_only=True)
class VoxelClouds:
    """One side of a batch; the clouds of several pairs are concatenated."""

    points: Tensor  # (N, 3) metres: the point that represents each voxel, in the input's order
    coords: Tensor  # (N, 4) int64: cloud, x, y, z
    features: Tensor  # (N, C)
    lengths: tuple[int, ...]  # voxels of each cloud
    pyramid: VoxelPyramid

    def to(self, device: torch.device | str) -> VoxelClouds:
        """The same voxels on another device."""
        return VoxelClouds(
            points=self.points.to(device),
            coords=self.coords.to(device),
            features=self.features.to(device),
            lengths=self.lengths,
            pyramid=self.pyramid.to(device),
        )


@dataclass(frozen=True, kw_only=True)
class FcgfBatch:
    """Both sides."""

    source: VoxelClouds
    target: VoxelClouds

    def to(self, device: torch.device | str) -> FcgfBatch:
        """The same batch on another device."""
        return FcgfBatch(source=self.source.to(device), target=self.target.to(device))


def make_batch(
    target: npt.NDArray[np.floating],
    source: npt.NDArray[np.floating],
    config: FcgfConfig,
    *,
    device: torch.device | str = "cpu",
) -> FcgfBatch:
    """A pair on the network's grid. The input features are ones.

    Parameters
    ----------
    target, source
        (M, 3), (N, 3) metres, each in its sensor's frame: the grid is anchored at its origin.
    config
        Of the network that will take the batch.
    device
        Where the tensors end up.

    Raises
    ------
    ValueError
        As `quantise`: no points, or points too far from the origin.
    """
    return FcgfBatch(
        source=_voxels(source, "source", config, device), target=_voxels(target, "target", config, device)
    )


def _voxels(
    cloud: npt.NDArray[np.floating], name: str, config: FcgfConfig, device: torch.device | str
) -> VoxelClouds:
    points = torch.from_numpy(np.array(cloud, dtype=np.float32)).to(device)
    try:
        rows, coords = quantise(points, config.voxel)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error
    coords = torch.cat([coords.new_zeros(len(coords), 1), coords], 1)
    return VoxelClouds(
        points=points[rows],
        coords=coords,
        features=torch.ones(len(rows), config.in_channels, device=device),
        lengths=(len(rows),),
        pyramid=VoxelPyramid(coords, config.strides),
    )


def collate(batches: Sequence[FcgfBatch]) -> FcgfBatch:
    """Several pairs as one batch: batch statistics and negatives are then over all of them, as published."""
    return FcgfBatch(
        source=_joined([batch.source for batch in batches]),
        target=_joined([batch.target for batch in batches]),
    )


def _joined(sides: list[VoxelClouds]) -> VoxelClouds:
    coords, first = [], 0
    for side in sides:
        moved = side.coords.clone()
        moved[:, 0] += first
        coords.append(moved)
        first += len(side.lengths)
    return VoxelClouds(
        points=torch.cat([side.points for side in sides]),
        coords=torch.cat(coords),
        features=torch.cat([side.features for side in sides]),
        lengths=tuple(length for side in sides for length in side.lengths),
        pyramid=VoxelPyramid(torch.cat(coords), sides[0].pyramid.strides),
    )


def noisy(
    batch: FcgfBatch, generator: torch.Generator, sigma: float = 0.01, probability: float = 0.95
) -> FcgfBatch:
    """Normal noise on the input features of most clouds, as in the published training (lib/transforms.py 18-30)."""

    def of(side: VoxelClouds) -> VoxelClouds:
        spoiled = torch.rand(len(side.lengths), generator=generator) < probability
        noise = sigma * torch.randn(side.features.shape, generator=generator)
        noise *= spoiled.repeat_interleave(torch.tensor(side.lengths))[:, None]
        return replace(side, features=side.features + noise.to(side.features.device))

    return FcgfBatch(source=of(batch.source), target=of(batch.target))
