# SPDX-License-Identifier: MIT
"""Voxels as single numbers, so that they can be sorted and searched."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class VoxelKeys:
    """One number for each voxel (cloud, x, y, z), in the order of cloud, z, y, x."""

    low: Tensor  # (4,) int64
    extent: Tensor  # (4,) int64

    @classmethod
    def spanning(cls, *coords: Tensor, margin: int = 0) -> VoxelKeys:
        every = torch.cat(coords)
        low, high = every.amin(0), every.amax(0)
        low[1:] -= margin
        high[1:] += margin
        extent = high - low + 1
        if float(extent.double().prod()) > 2**62:
            raise ValueError(
                f"{extent[1:].tolist()} voxels cannot be numbered: a stray point lies far from the others (crop the "
                "cloud), or the voxel is too small"
            )
        return cls(low, extent)

    def of(self, coords: Tensor) -> Tensor:
        """(N,) int64."""
        cloud, x, y, z = (coords - self.low).unbind(1)
        return ((cloud * self.extent[3] + z) * self.extent[2] + y) * self.extent[1] + x

    def step(self, dy: Tensor, dz: Tensor) -> Tensor:
        """By how much a key grows along y and z."""
        return (dz * self.extent[2] + dy) * self.extent[1]
