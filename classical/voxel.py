# SPDX-License-Identifier: MIT
"""Voxel grid: one point per occupied cell, the centroid of its members."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hybridreg.pair import Pair
from hybridreg.resolution import comparable, default_voxel
from hybridreg.scene import Level, Scene
from hybridreg.stage import Stage

Array = NDArray[np.float64]

_MOST_CELLS = 2**62
# Where the shorter of two reaches gives so small a voxel that the other cloud keeps more points, no method gains by
# them, and all take longer.
_MOST_POINTS = 30_000


@dataclass(frozen=True, kw_only=True)
class VoxelGrid(Stage):
    """Downsample both clouds to the centroids of a grid's cells.

    Parameters
    ----------
    voxel : float or None
        Edge of a cell, metres. None derives one length for both clouds from how far they reach
        (`hybridreg.resolution.default_voxel`), a longer one where a cloud would keep more than 30,000 points of its
        own otherwise, and notes it in the result.
    density : "keep" or "match"
        "match" gives each cloud the voxel at which both have about as many points per occupied volume; for a
        sparse sensor against a dense one.
    """

    voxel: float | None = None
    density: Literal["keep", "match"] = "keep"

    def __post_init__(self) -> None:
        if self.voxel is not None and not 0.0 < self.voxel < np.inf:
            raise ValueError(f"voxel={self.voxel} must be a positive length in metres")
        if self.density not in ("keep", "match"):
            raise ValueError(f"density={self.density!r} must be 'keep' or 'match'")

    def __call__(self, pair: Pair) -> Scene:
        clouds = (pair.source, pair.target)
        if self.voxel is None and not comparable(*clouds):
            return _each_by_itself(pair)
        voxel = self.voxel or default_voxel(pair.source, pair.target)
        reached = voxel
        points = [voxel_centroids(cloud.points, voxel) for cloud in clouds]
        at = [voxel, voxel]
        while self.voxel is None and (most := max(map(len, points))) > _MOST_POINTS:
            voxel = _two_digits_up(voxel * (most / _MOST_POINTS) ** 0.5)
            for k, cloud in enumerate(clouds):
                if len(points[k]) > _MOST_POINTS:
                    points[k], at[k] = voxel_centroids(cloud.points, voxel), voxel
        for k, cloud in enumerate(clouds):  # one of few points follows when the voxel is found
            if at[k] != voxel:
                points[k] = voxel_centroids(cloud.points, voxel)
        spacing = [voxel, voxel]
        if self.density == "match":
            dense = int(np.argmax([len(p) for p in points]))
            points[dense], spacing[dense] = _thin(clouds[dense].points, voxel, len(points[1 - dense]))
        source, target = (
            Level(points=p, spacing=s, viewpoint=c.viewpoint)
            for p, s, c in zip(points, spacing, clouds, strict=True)
        )
        scene = Scene(pair=pair, source=source, target=target)
        if self.voxel is None:
            scene.note(
                f"voxel {voxel:.3g} m, derived from the clouds' reach"
                + (f" ({reached:.3g} m) and the number of points" if voxel > reached else "")
            )
        return scene


def _each_by_itself(pair: Pair) -> Scene:
    # One length for a cloud in millimetres and one in metres would leave nothing of the second.
    levels = []
    for cloud in (pair.source, pair.target):
        voxel = default_voxel(pair.source, pair.target)
        points = voxel_centroids(cloud.points, voxel)
        while len(points) > _MOST_POINTS:
            voxel = _two_digits_up(voxel * (len(points) / _MOST_POINTS) ** 0.5)
            points = voxel_centroids(cloud.points, voxel)
        levels.append(Level(points=points, spacing=voxel, viewpoint=cloud.viewpoint))
    source, target = levels
    scene = Scene(pair=pair, source=source, target=target)
    scene.note(f"voxels {source.spacing:.3g} and {target.spacing:.3g} m: the clouds' reaches are so unlike")
    return scene


def _two_digits_up(length: float) -> float:
    unit = 10.0 ** (math.floor(math.log10(length)) - 1)
    return float(f"{math.ceil(length / unit) * unit:.2g}")


def voxel_centroids(points: Array, voxel: float) -> Array:
    """Centroids (n, 3) of the occupied cells of a grid, ordered by cell.

    Parameters
    ----------
    points : (N, 3)
    voxel : float
        Edge of a cell, metres.

    Raises
    ------
    ValueError
        If the grid has more cells than an index can tell apart.
    """
    columns = np.ascontiguousarray(points.T)  # (3, N): numpy reduces along rows ten times faster
    key, n_cells = _cell_of(columns, voxel)
    member, n = _members(key, n_cells)
    count = np.bincount(member, minlength=n)
    sums = [np.bincount(member, weights=column, minlength=n) for column in columns]
    return np.column_stack(sums) / count[:, None]


def _cell_of(columns: Array, voxel: float) -> tuple[NDArray[np.int64], int]:
    # The origin lies a hair below the smallest coordinate: data rounded to millimetres would otherwise sit on
    # cell borders, where the last digit of a float decides.
    origin = columns.min(axis=1) - 1e-5 * voxel
    shape = np.floor((columns.max(axis=1) - origin) / voxel) + 1.0
    if math.prod(shape.tolist()) > _MOST_CELLS:
        raise ValueError(
            f"a voxel of {voxel:.3g} m cuts the cloud into {' x '.join(f'{s:.3g}' for s in shape)} cells; "
            "choose a larger voxel or check the unit"
        )
    x, y, z = ((columns - origin[:, None]) / voxel).astype(np.int64)
    nx, ny, nz = (int(s) for s in shape)
    return x + nx * (y + ny * z), nx * ny * nz


def _members(key: NDArray[np.int64], n_cells: int) -> tuple[NDArray[np.int64], int]:
    # Rank of each point's cell among the occupied ones, and their number.
    bits = len(key).bit_length()
    if n_cells >= 2 ** (63 - bits):
        cells, member = np.unique(key, return_inverse=True)
        return member, len(cells)
    # Cell and row in one number, because numpy sorts numbers several times faster than it finds their order.
    both = np.sort((key << bits) | np.arange(len(key)))
    cell = both >> bits
    first = np.concatenate([[True], cell[1:] != cell[:-1]])
    rank = np.cumsum(first) - 1
    member = np.empty(len(key), dtype=np.int64)
    member[both & ((1 << bits) - 1)] = rank
    return member, int(rank[-1]) + 1


def _thin(points: Array, voxel: float, n_wanted: int) -> tuple[Array, float]:
    # Bisection on the voxel: the count falls monotonically enough for twelve halvings to meet it within a percent.
    low, high = voxel, 16.0 * voxel
    for _ in range(12):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if len(voxel_centroids(points, middle)) > n_wanted else (low, middle)
    return voxel_centroids(points, high), float(high)
