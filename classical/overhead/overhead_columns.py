# SPDX-License-Identifier: MIT
"""A cloud projected from above: occupied columns and free ones, in layers of height."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.extent import bounds
from hybridreg.geometry.terrain import Terrain

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Edge of a terrain cell, columns; by hand.
_TERRAIN = 8.0
# Edge of a free column, columns: free space needs less detail; by hand.
_FREE_WIDTH = 1.5
# Free columns left out before a ray's return; by hand.
_BEFORE = 1
# Samples of all rays together, about: neighbouring rays cross the same columns; for speed.
_MOST_PLACES = 120_000


class Columns(NamedTuple):
    """Places (n,) in the levelled frame, as complex numbers x + iy in metres, and the layer (n,) of each."""

    places: NDArray[np.complex128]
    layer: Integers


class FromAbove(NamedTuple):
    """One cloud: columns that hold points, and columns that only rays cross."""

    filled: Columns
    free: Columns
    n_layers: int


def from_above(points: Array, eye: Array | None, edges: tuple[float, ...], width: float) -> FromAbove:
    """Columns of a levelled cloud.

    Parameters
    ----------
    points : (n, 3)
        Metres, in a frame whose z = 0 is the ground plane.
    eye : (3,) or None
        Where the sensor stood in that frame; without it no place counts as free.
    edges : tuple of float
        Borders of the layers, metres over the ground, rising.
    width : float
        Edge of a column, metres.
    """
    terrain = Terrain.of(points, _TERRAIN * width)
    wide = _FREE_WIDTH * width
    along = np.zeros((0, 3)) if eye is None else _along_rays(points, eye, wide)
    return FromAbove(
        _columns(points, points[:, 2] - terrain.at(points[:, :2]), edges, width),
        _columns(along, along[:, 2] - terrain.at(along[:, :2]), edges, wide),
        len(edges) - 1,
    )


def _columns(points: Array, heights: Array, edges: tuple[float, ...], width: float) -> Columns:
    layer = np.searchsorted(edges, heights, side="right") - 1
    inside = (layer >= 0) & (layer < len(edges) - 1)
    if not inside.any():
        return Columns(np.zeros(0, dtype=np.complex128), np.zeros(0, dtype=np.int64))
    ij = np.floor(points[inside, :2] / width).astype(np.int64)
    low, high = bounds(ij)
    nx, ny = high - low + 1
    held = np.zeros((len(edges) - 1, nx, ny), dtype=bool)
    held[layer[inside], ij[:, 0] - low[0], ij[:, 1] - low[1]] = True
    layer, i, j = np.nonzero(held)
    return Columns(width * ((i + low[0] + 0.5) + 1j * (j + low[1] + 0.5)), layer)


def _along_rays(points: Array, eye: Array, width: float) -> Array:
    # A place in each column on the way to each point, but for the last ones.
    flat = np.hypot(*(points - eye).T[:2])
    every = max(1, int(flat.sum() / width / _MOST_PLACES))
    ray, flat = points[::every] - eye, flat[::every]
    steps = np.maximum((flat / width).astype(np.int64) - _BEFORE, 0)
    row = np.repeat(np.arange(len(steps)), steps)
    nth = np.arange(len(row)) - np.repeat(np.cumsum(steps) - steps, steps)
    share = (nth + 0.5) * width / flat[row]
    return eye + share[:, None] * ray[row]
