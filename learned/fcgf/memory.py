# SPDX-License-Identifier: MIT
"""Memory estimate of a forward pass of FCGF, before it runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from hybridreg.learned.fcgf.config import FcgfConfig
from hybridreg.learned.layers.sparse_conv import FEW_CHANNELS
from hybridreg.learned.layers.voxels import VoxelPyramid
from hybridreg.learned.memory_estimate import SLACK

_FLOAT = 4  # bytes
_INDEX = 8  # bytes
_PER_PAIR = 2 * _INDEX  # a list of pairs stores its inputs and its outputs
_COPIES = 3  # of a layer's output alive at a time: normalised, rectified, and what a block adds to it


class _Layer(NamedTuple):
    kernel: int
    fine: int  # levels
    coarse: int
    back: bool  # from coarse to fine
    dim_in: int
    dim_out: int

    @property
    def at_once(self) -> bool:
        # The inputs of all offsets are concatenated; other layers hold one product a pair.
        return self.dim_in <= FEW_CHANNELS and not self.back


def forward_bytes(pyramids: Sequence[VoxelPyramid], config: FcgfConfig) -> int:
    """Peak of a forward pass over the pyramids one after another, whose maps are all kept. Builds the maps' tables."""
    kept = sum(_maps(pyramid, config) for pyramid in pyramids)
    return SLACK + kept + max(_working(pyramid, config) for pyramid in pyramids)


def _layers(config: FcgfConfig) -> Iterator[_Layer]:
    widths, back = config.channels, config.tr_channels
    for level, width in enumerate(widths):
        before = widths[level - 1] if level else config.in_channels
        kernel = config.kernel if level else config.first_kernel
        yield _Layer(kernel, max(level - 1, 0), level, False, before, width)
        yield _Layer(config.kernel, level, level, False, width, width)
        if level + 1 < len(widths):
            joined = widths[-1] if level + 2 == len(widths) else back[level + 2] + widths[level + 1]
            yield _Layer(config.tr_kernel, level, level + 1, True, joined, back[level + 1])
            yield _Layer(config.kernel, level, level, False, back[level + 1], back[level + 1])
    yield _Layer(1, 0, 0, False, back[1] + widths[0], back[0])
    yield _Layer(config.final_kernel, 0, 0, False, back[0], config.out_channels)


def _needs_map(layer: _Layer) -> bool:
    return layer.kernel > 1 or layer.fine != layer.coarse


def _maps(pyramid: VoxelPyramid, config: FcgfConfig) -> int:
    layers = [layer for layer in _layers(config) if _needs_map(layer)]
    tables = {layer[:3]: pyramid.map(*layer[:3]) for layer in layers}
    listed = {layer[:3] for layer in layers if not layer.at_once}
    pairs = sum(tables[key].n_pairs for key in listed)
    return pairs * _PER_PAIR + sum(each.table.numel() for each in tables.values()) * _FLOAT


def _working(pyramid: VoxelPyramid, config: FcgfConfig) -> int:
    voxels = [len(level) for level in pyramid.levels]
    skips = sum(n * width for n, width in zip(voxels, config.channels, strict=True))

    def of(layer: _Layer) -> int:
        n_in, n_out = (
            voxels[layer.coarse if layer.back else layer.fine],
            voxels[layer.fine if layer.back else layer.coarse],
        )
        products = 0
        if _needs_map(layer):
            table = pyramid.map(*layer[:3])
            products = table.table.numel() * layer.dim_in if layer.at_once else table.n_pairs * layer.dim_out
        return products + n_in * layer.dim_in + n_out * layer.dim_out * _COPIES

    return (max(of(layer) for layer in _layers(config)) + skips) * _FLOAT
