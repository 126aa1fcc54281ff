# SPDX-License-Identifier: MIT
"""Kernel maps of sparse convolutions: which voxels a kernel connects."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from hybridreg.learned.layers.voxel_keys import VoxelKeys


@dataclass(frozen=True, kw_only=True)
class Pairs:
    """Input and output voxels of every product, sorted by kernel offset.

    input, output : (M,) int64 rows
    counts : number of pairs of each of the K^3 offsets
    n_input, n_output : voxels on either side
    """

    input: Tensor
    output: Tensor
    counts: tuple[int, ...]
    n_input: int
    n_output: int

    def __len__(self) -> int:
        return len(self.input)

    @cached_property
    def by_output(self) -> tuple[Tensor, Tensor]:
        """Pairs sorted by output (M,), and where each output's pairs begin (n_output,)."""
        order = self.output.int().argsort(stable=True)  # half the bytes, half the time
        counts = torch.bincount(self.output, minlength=self.n_output)
        return order, counts.cumsum(0) - counts

    @cached_property
    def transposed(self) -> Pairs:
        """The same pairs swapped: MinkowskiEngine's transposed convolution, whose kernel is not flipped."""
        return Pairs(
            input=self.output,
            output=self.input,
            counts=self.counts,
            n_input=self.n_output,
            n_output=self.n_input,
        )


@dataclass(frozen=True, kw_only=True)
class KernelMap:
    """The input voxel of each output voxel at each kernel offset.

    table : (n_output, K^3) int32 rows, n_input where there is no voxel
    """

    table: Tensor
    n_input: int

    def narrower(self, size: int) -> KernelMap:
        """The map of a kernel of the same centre and a smaller odd edge."""
        edge = round(self.table.shape[1] ** (1 / 3))
        some = slice((edge - size) // 2, (edge + size) // 2)
        cells = self.table.view(-1, edge, edge, edge)[:, some, some, some]
        return KernelMap(table=cells.reshape(len(self.table), size**3), n_input=self.n_input)

    @cached_property
    def n_pairs(self) -> int:
        """Number of products."""
        return int((self.table < self.n_input).sum())

    @cached_property
    def pairs(self) -> Pairs:
        """The same as a list."""
        n_output, volume = self.table.shape
        by_offset = self.table.t().reshape(-1)
        found = (by_offset < self.n_input).nonzero()[:, 0]
        first = torch.arange(0, len(by_offset) + 1, max(1, n_output), device=found.device)[: volume + 1]
        counts = torch.searchsorted(found, first).diff()
        return Pairs(
            input=by_offset[found].long(),
            output=found - first[:volume].repeat_interleave(counts, output_size=len(found)),
            counts=tuple(counts.tolist()),
            n_input=self.n_input,
            n_output=n_output,
        )


def kernel_offsets(size: int) -> Tensor:
    """(size^3, 3) int64 offsets (x, y, z) as MinkowskiEngine 0.5.4 numbers them (src/kernel_region.hpp).

    x varies fastest; odd kernels are centred, even ones begin at 0.
    """
    z, y, x = torch.meshgrid(*[_line(size)] * 3, indexing="ij")
    return torch.stack([x, y, z], -1).reshape(-1, 3)


def _line(size: int) -> Tensor:
    return torch.arange(size) - (size // 2 if size % 2 else 0)


def kernel_map(inputs: Tensor, outputs: Tensor, size: int, stride: int) -> KernelMap:
    """The map of a kernel of edge ``size`` between voxels (N, 4) and (M, 4), both sorted by cloud, z, y, x.

    An output c meets the input at c + offset times the stride of the *input*.
    """
    # Between the voxels of one level an odd kernel is its own mirror image: half of its rows are searched.
    mirrored = inputs is outputs and size % 2 == 1
    scale = torch.tensor([1, stride, stride, stride], device=inputs.device)
    inputs, outputs = inputs.div(scale, rounding_mode="floor"), outputs.div(scale, rounding_mode="floor")
    keys, line = VoxelKeys.spanning(inputs, outputs, margin=size), _line(size).to(inputs.device)
    have, volume = keys.of(inputs), size**3
    dz, dy = torch.meshgrid(line, line, indexing="ij")
    steps = keys.step(dy, dz).flatten()[: size**2 // 2 + 1 if mirrored else None]
    # Neighbours along x have successive keys: one search finds the first of a row of the kernel, the others follow it.
    # Row by row, so that the keys that are searched rise: half of the time.
    rows = (keys.of(outputs) + (steps + line[0])[:, None]).flatten()
    table = torch.full((len(outputs) * volume,), len(inputs), dtype=torch.int32, device=rows.device)
    first = torch.arange(0, len(table), volume, device=rows.device)
    at = (first + size * torch.arange(len(steps), device=rows.device)[:, None]).flatten()
    place = torch.searchsorted(have, rows)
    have = torch.cat([have, have.new_full((size,), 2**62)])
    for _ in range(size):
        apart = have.index_select(0, place).sub_(rows)
        found = (apart < size).nonzero()[:, 0]
        at, place, rows = (part.index_select(0, found) for part in (at, place, rows))
        cell = at + apart.index_select(0, found)
        table.scatter_(0, cell, place.int())
        if mirrored:
            output = cell.div(volume, rounding_mode="floor")
            table.scatter_(0, (place + output) * volume + (volume - 1) - cell, output.int())
        place += 1
    return KernelMap(table=table.view(len(outputs), volume), n_input=len(inputs))
