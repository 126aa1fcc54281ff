# SPDX-License-Identifier: MIT
"""Voxels as single numbers, so that they can be sorted and searched."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

# Up to so many cells for each voxel its row is looked up in a table of all cells, one kilobyte a voxel; the keys of
# emptier grids are searched.
_CELLS_PER_VOXEL = 256


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

    def rows_of_runs(self, keys: Tensor, first: Tensor, length: int) -> Tensor:
        """(R, length, M) int32: the rows of ``keys`` (N,), sorted and distinct, that hold each run of successive keys.

        ``first`` (R, M) are the keys that the runs begin with; N stands where there is no such key.
        """
        cells = int(self.extent.prod())
        if cells <= _CELLS_PER_VOXEL * len(keys):
            table = keys.new_full((cells,), len(keys), dtype=torch.int32)
            table[keys] = torch.arange(len(keys), dtype=torch.int32, device=keys.device)
            wanted = first[:, None] + torch.arange(length, device=keys.device)[:, None]
            return table.index_select(0, wanted.flatten()).view(wanted.shape)
        # One search finds the first of a run, the others follow it.
        rows, found = torch.searchsorted(keys, first.contiguous(), out_int32=True), []
        after = torch.cat([keys, keys.new_full((1,), 2**62)])
        for step in range(length):
            hit = after[rows] == first + step
            found.append(rows.where(hit, len(keys)))
            rows = rows + hit
        return torch.stack(found, 1)
