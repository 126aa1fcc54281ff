# SPDX-License-Identifier: MIT
"""Kernel maps of sparse convolutions: which voxels a kernel connects."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
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
        # numpy sorts numbers of 16 bits by radix, torch does not: a third of the time.
        short = self.output.numpy(force=True).astype(np.min_scalar_type(self.n_output))
        order = torch.from_numpy(np.argsort(short, kind="stable")).to(self.output.device)
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

    table : (K^3, n_output) int32 rows, n_input where there is no voxel
    """

    table: Tensor
    n_input: int

    def narrower(self, size: int) -> KernelMap:
        """The map of a kernel of the same centre and a smaller odd edge."""
        edge = round(len(self.table) ** (1 / 3))
        some = slice((edge - size) // 2, (edge + size) // 2)
        cells = self.table.view(edge, edge, edge, -1)[some, some, some]
        return KernelMap(table=cells.reshape(size**3, self.table.shape[1]), n_input=self.n_input)

    @cached_property
    def n_pairs(self) -> int:
        """Number of products."""
        return int((self.table < self.n_input).sum())

    @cached_property
    def pairs(self) -> Pairs:
        """The same as a list."""
        volume, n_output = self.table.shape
        by_offset = self.table.flatten()
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
    if stride > 1:
        scale = torch.tensor([1, stride, stride, stride], device=inputs.device)
        inputs, outputs = (coords.div(scale, rounding_mode="floor") for coords in (inputs, outputs))
    keys, line = VoxelKeys.spanning(inputs, outputs, margin=size), _line(size).to(inputs.device)
    z, y = torch.meshgrid(line, line, indexing="ij")
    # Neighbours along x have successive keys.
    first = (keys.step(y, z) + line[0]).flatten()[:, None] + keys.of(outputs)
    table = keys.rows_of_runs(keys.of(inputs), first, size)
    return KernelMap(table=table.view(size**3, len(outputs)), n_input=len(inputs))
