# SPDX-License-Identifier: MIT
"""How much memory a forward pass of FCGF will take, told before it runs."""

from __future__ import annotations

from collections.abc import Sequence

from hybridreg.learned.fcgf.config import FcgfConfig
from hybridreg.learned.layers.voxels import VoxelPyramid

_FLOAT, _INDEX = 4, 8
_PER_PAIR = 3 * _INDEX  # a kernel map keeps its input, its output, and the order of its outputs
_COPIES = 4  # of a level's features alive at a time: input, output, and the steps between
_SLACK = 2**26  # what the heap holds beside what is in use


def forward_bytes(pyramids: Sequence[VoxelPyramid], config: FcgfConfig) -> int:
    """Peak of a forward pass over the pyramids one after another, whose maps all stay. Makes the maps."""
    kept = sum(_maps(pyramid, config) for pyramid in pyramids)
    return _SLACK + kept + max(_working(pyramid, config) for pyramid in pyramids)


def used_maps(config: FcgfConfig) -> list[tuple[int, int, int]]:
    """(kernel, fine, coarse) of the maps that the network asks for."""
    depth = len(config.channels)
    same = [(config.kernel, level, level) for level in range(depth)]
    down = [(k, level, level + 1) for k in (config.kernel, config.tr_kernel) for level in range(depth - 1)]
    wide = [(config.first_kernel, 0, 0), (config.final_kernel, 0, 0)]
    return sorted({key for key in [*wide, *same, *down] if key[0] > 1 or key[1] != key[2]})


def _maps(pyramid: VoxelPyramid, config: FcgfConfig) -> int:
    return sum(len(pyramid.map(*key)) * _PER_PAIR for key in used_maps(config))


def _working(pyramid: VoxelPyramid, config: FcgfConfig) -> int:
    voxels = [len(level) for level in pyramid.levels]
    skips = sum(n * width for n, width in zip(voxels, config.channels, strict=True))
    # The first layer lays the inputs of all offsets side by side; the others hold one product a pair.
    widest = [voxels[0] * config.first_kernel**3 * config.in_channels]
    for level, n in enumerate(voxels):
        width = max(config.channels[level], config.tr_channels[min(level + 1, len(voxels) - 1)])
        joined = width + config.channels[level]
        pairs = max(
            len(pyramid.map(*key))
            for key in used_maps(config)
            if level in key[1:] and key[0] <= config.kernel
        )
        widest.append(pairs * width + n * joined * _COPIES)
    return (max(widest) + skips) * _FLOAT
