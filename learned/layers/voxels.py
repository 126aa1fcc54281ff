# SPDX-License-Identifier: MIT
"""Occupied voxels of one or several clouds, and their strided levels."""

from __future__ import annotations

import torch
from torch import Tensor

from hybridreg.learned.layers.kernel_maps import KernelMap, kernel_map
from hybridreg.learned.layers.voxel_keys import VoxelKeys

# Voxel indices come from a float32 division, exact below this.
_LARGEST_INDEX = 2**24


def quantise(points: Tensor, voxel: float) -> tuple[Tensor, Tensor]:
    """One point for each occupied voxel: the first in the input's order.

    The index is floored in the points' own precision, as in FCGF (lib/data_loaders.py: float32 for KITTI). The grid is
    anchored at the origin.

    Parameters
    ----------
    points
        (N, 3), metres.
    voxel
        Edge, metres.

    Returns
    -------
    rows
        (M,) int64 of the representatives, ascending.
    coords
        (M, 3) int64.

    Raises
    ------
    ValueError
        No points, or points so far from the origin that float32 cannot tell their voxels apart.
    """
    if len(points) == 0:
        raise ValueError("a cloud without points has no voxels")
    # A tensor, not a number: on a GPU torch multiplies by the inverse of a number, which moves border points.
    coords = torch.floor(points / torch.tensor(voxel, dtype=points.dtype, device=points.device))
    farthest = float(coords.abs().max())
    if not farthest < _LARGEST_INDEX:
        raise ValueError(
            f"a point lies {farthest:.3g} voxels of {voxel:g} m from the origin, and {_LARGEST_INDEX} are the most "
            "that float32 can tell apart: take a larger voxel, or shift the cloud towards the origin"
        )
    coords = coords.long()
    key = VoxelKeys.spanning(_with_cloud(coords)).of(_with_cloud(coords))
    order = key.argsort(stable=True)
    first = torch.ones_like(key, dtype=torch.bool)
    first[1:] = key[order[1:]] != key[order[:-1]]
    rows = order[first].sort().values
    return rows, coords[rows]


def _with_cloud(coords: Tensor) -> Tensor:
    return torch.cat([coords.new_zeros(len(coords), 1), coords], 1)


class VoxelPyramid:
    """Levels of voxels, each floored to a multiple of its stride, and the kernel maps between them.

    Rows of a level are sorted by cloud, z, y, x. Maps are built on first access, and kept.

    Parameters
    ----------
    coords
        (N, 4) int64 (cloud, x, y, z), distinct.
    strides
        Of the levels, in voxels; the first is 1, each a multiple of the one before.
    """

    def __init__(self, coords: Tensor, strides: tuple[int, ...]) -> None:
        key = VoxelKeys.spanning(coords).of(coords)
        self.order = key.argsort()  # of the input's rows: level 0 is coords[order]
        self.inverse = torch.empty_like(self.order)
        self.inverse[self.order] = torch.arange(len(coords), device=coords.device)
        self.strides = strides
        self.levels = [coords[self.order]]
        for stride in strides[1:]:
            self.levels.append(_strided(self.levels[-1], stride))
        self._maps: dict[tuple[int, int, int], KernelMap] = {}

    def __len__(self) -> int:
        return len(self.levels)

    def to(self, device: torch.device | str) -> VoxelPyramid:
        """The same voxels on another device."""
        return VoxelPyramid(self.levels[0][self.inverse].to(device), self.strides)

    def map(self, kernel: int, fine: int, coarse: int) -> KernelMap:
        """Map of a convolution of edge ``kernel`` from level ``fine`` to level ``coarse``, counted from 0.

        An output c takes the input at c + offset times the stride of the *input*: the strided kernel is centred on the
        low corner of its cell.
        """
        key = (kernel, fine, coarse)
        if key not in self._maps:
            wider = [
                k
                for k, *levels in self._maps
                if levels == [fine, coarse] and k > kernel and k % 2 == kernel % 2 == 1
            ]
            if wider:
                self._maps[key] = self._maps[min(wider), fine, coarse].narrower(kernel)
            else:
                self._maps[key] = kernel_map(
                    self.levels[fine], self.levels[coarse], kernel, self.strides[fine]
                )
        return self._maps[key]


def _strided(coords: Tensor, stride: int) -> Tensor:
    floored = coords.clone()
    floored[:, 1:] = coords[:, 1:].div(stride, rounding_mode="floor") * stride
    keys = VoxelKeys.spanning(floored)
    key = keys.of(floored).sort()
    first = torch.ones_like(key.values, dtype=torch.bool)
    first[1:] = key.values[1:] != key.values[:-1]
    return floored[key.indices[first]]
