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
        order = self.output.argsort(stable=True)
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
        offset = found.div(n_output, rounding_mode="floor")
        return Pairs(
            input=by_offset[found].long(),
            output=found - offset * n_output,
            counts=tuple(torch.bincount(offset, minlength=volume).tolist()),
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
    scale = torch.tensor([1, stride, stride, stride], device=inputs.device)
    inputs, outputs = inputs.div(scale, rounding_mode="floor"), outputs.div(scale, rounding_mode="floor")
    keys, line = VoxelKeys.spanning(inputs, outputs, margin=size), _line(size).to(inputs.device)
    have = keys.of(inputs)
    dz, dy = torch.meshgrid(line, line, indexing="ij")
    # Neighbours along x have successive keys: one search finds the first of a kernel row, the others follow.
    rows = (keys.of(outputs)[:, None] + keys.step(dy, dz).flatten() + line[0]).flatten()
    table = torch.full((len(rows) * size,), len(inputs), dtype=torch.int32, device=rows.device)
    at, place = torch.arange(0, len(table), size, device=rows.device), torch.searchsorted(have, rows)
    have = torch.cat([have, have.new_full((size,), 2**62)])
    for _ in range(size):
        apart = have.index_select(0, place).sub_(rows)
        found = (apart < size).nonzero()[:, 0]
        at, place, rows = (part.index_select(0, found) for part in (at, place, rows))
        table[at + apart.index_select(0, found)] = place.int()
        place += 1
    return KernelMap(table=table.view(len(outputs), size**3), n_input=len(inputs))
