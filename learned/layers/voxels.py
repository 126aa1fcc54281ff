# SPDX-License-Identifier: MIT
"""Occupied voxels of one or several clouds, their strided levels, and which of them a kernel connects."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

# Voxel indices come from a float32 division, exact below this.
_LARGEST_INDEX = 2**24


@dataclass(frozen=True, kw_only=True)
class KernelMap:
    """Which input voxel meets which output voxel at which kernel offset, sorted by offset, then by output.

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
        return _bags(self.output, self.n_output)

    @cached_property
    def by_input(self) -> tuple[Tensor, Tensor]:
        """Pairs sorted by input (M,), and where each input's pairs begin (n_input,)."""
        return _bags(self.input, self.n_input)

    @cached_property
    def transposed(self) -> KernelMap:
        """The same pairs turned round: MinkowskiEngine's transposed convolution, whose kernel is not flipped."""
        return KernelMap(
            input=self.output,
            output=self.input,
            counts=self.counts,
            n_input=self.n_output,
            n_output=self.n_input,
        )


def _bags(row: Tensor, n_rows: int) -> tuple[Tensor, Tensor]:
    order = row.argsort(stable=True)
    return order, torch.searchsorted(row[order], torch.arange(n_rows, device=row.device))


def kernel_offsets(size: int) -> Tensor:
    """(size^3, 3) int64 offsets (x, y, z) as MinkowskiEngine 0.5.4 numbers them (src/kernel_region.hpp).

    x turns fastest; odd kernels are centred, even ones begin at 0.
    """
    line = torch.arange(size) - (size // 2 if size % 2 else 0)
    z, y, x = torch.meshgrid(line, line, line, indexing="ij")
    return torch.stack([x, y, z], -1).reshape(-1, 3)


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
    key = _Keys.spanning(_with_cloud(coords)).of(_with_cloud(coords))
    order = key.argsort(stable=True)
    first = torch.ones_like(key, dtype=torch.bool)
    first[1:] = key[order[1:]] != key[order[:-1]]
    rows = order[first].sort().values
    return rows, coords[rows]


def _with_cloud(coords: Tensor) -> Tensor:
    return torch.cat([coords.new_zeros(len(coords), 1), coords], 1)


@dataclass(frozen=True)
class _Keys:
    """One number for each voxel (cloud, x, y, z), in the order of cloud, z, y, x."""

    low: Tensor  # (4,) int64
    extent: Tensor  # (4,) int64

    @classmethod
    def spanning(cls, *coords: Tensor, margin: int = 0) -> _Keys:
        every = torch.cat(coords)
        low, high = every.amin(0), every.amax(0)
        low[1:] -= margin
        high[1:] += margin
        extent = high - low + 1
        if float(extent.double().prod()) > 2**62:
            raise ValueError(
                f"{extent[1:].tolist()} voxels cannot be numbered: a stray point lies far from the others (crop the "
                "cloud), or the voxel is too small for it"
            )
        return cls(low, extent)

    def of(self, coords: Tensor) -> Tensor:
        """(N,) int64."""
        cloud, x, y, z = (coords - self.low).unbind(1)
        return ((cloud * self.extent[3] + z) * self.extent[2] + y) * self.extent[1] + x

    def step(self, dy: Tensor, dz: Tensor) -> Tensor:
        """By how much a key grows along y and z."""
        return (dz * self.extent[2] + dy) * self.extent[1]


class VoxelPyramid:
    """Levels of voxels, each floored to a multiple of its stride, and the kernel maps between them.

    Rows of a level are sorted by cloud, z, y, x. Maps are made when they are first asked for, and kept.

    Parameters
    ----------
    coords
        (N, 4) int64 (cloud, x, y, z), distinct.
    strides
        Of the levels, in voxels; the first is 1, each a multiple of the one before.
    """

    def __init__(self, coords: Tensor, strides: tuple[int, ...]) -> None:
        key = _Keys.spanning(coords).of(coords)
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
        """Pairs of a convolution of edge ``kernel`` from level ``fine`` to level ``coarse``, counted from 0.

        An output c takes the input at c + offset times the stride of the *input*: the strided kernel is centred on the
        low corner of its cell.
        """
        key = (kernel, fine, coarse)
        if key not in self._maps:
            self._maps[key] = kernel_map(self.levels[fine], self.levels[coarse], kernel, self.strides[fine])
        return self._maps[key]


def _strided(coords: Tensor, stride: int) -> Tensor:
    floored = coords.clone()
    floored[:, 1:] = coords[:, 1:].div(stride, rounding_mode="floor") * stride
    keys = _Keys.spanning(floored)
    key = keys.of(floored).sort()
    first = torch.ones_like(key.values, dtype=torch.bool)
    first[1:] = key.values[1:] != key.values[:-1]
    return floored[key.indices[first]]


def kernel_map(inputs: Tensor, outputs: Tensor, size: int, stride: int) -> KernelMap:
    """Pairs of input (N, 4) and output (M, 4) voxels, both sorted as a level, at each offset of a kernel.

    Neighbours along x have successive keys, so that one search a row of the kernel finds all of them.
    """
    scale = torch.tensor([1, stride, stride, stride], device=inputs.device)
    inputs, outputs = inputs.div(scale, rounding_mode="floor"), outputs.div(scale, rounding_mode="floor")
    keys = _Keys.spanning(inputs, outputs, margin=size)
    have, line = keys.of(inputs), torch.arange(size, device=inputs.device) - (size // 2 if size % 2 else 0)
    dz, dy = torch.meshgrid(line, line, indexing="ij")
    rows = (
        keys.of(outputs)[:, None] + keys.step(dy, dz).flatten() + line[0]
    )  # (M, size^2): each row's first key
    place = torch.searchsorted(have, rows)
    table = torch.full((rows.numel(), size), -1, dtype=torch.int32, device=rows.device)
    for _ in range(size):
        apart = have[place.clamp_max(len(have) - 1)] - rows
        found = ((place < len(have)) & (apart < size)).flatten().nonzero()[:, 0]
        table[found, apart.flatten()[found]] = place.flatten()[found].int()
        place = place + 1
    table = table.view(len(outputs), size**3).t().contiguous()
    offset, output = (table >= 0).nonzero(as_tuple=True)
    return KernelMap(
        input=table[offset, output].long(),
        output=output,
        counts=tuple(torch.bincount(offset, minlength=size**3).tolist()),
        n_input=len(inputs),
        n_output=len(outputs),
    )
