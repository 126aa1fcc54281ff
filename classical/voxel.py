# SPDX-License-Identifier: MIT
"""Voxel grid: one point per occupied cell, the centroid of its members."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud
from hybridreg.flat_scans import raised
from hybridreg.geometry.voxel_cells import voxel_centroids
from hybridreg.pair import Pair
from hybridreg.resolution import comparable, default_voxel
from hybridreg.runtime.side_by_side import side_by_side
from hybridreg.scene import SIDES, Level, Scene, Side
from hybridreg.stage import Stage
from hybridreg.thinning import thinned

Array = NDArray[np.float64]

# Where the shorter of two extents gives so small a voxel that the other cloud keeps more points, no method gains by
# them, and all take longer.
_MOST_POINTS = 30_000


@dataclass(frozen=True, kw_only=True)
class VoxelGrid(Stage):
    """Downsample both clouds to the centroids of a grid's cells.

    Parameters
    ----------
    voxel : float or None
        Edge of a cell, metres. None derives one length for both clouds from their extents
        (`hybridreg.resolution.default_voxel`), a longer one where a cloud would otherwise keep more than 30,000
        points, and notes it in the result. A cloud of more than 900,000 points is first thinned to
        cells of a quarter of that (`hybridreg.thinning`).
    density : "keep" or "match"
        "match" gives each cloud the voxel at which both have about as many points per occupied volume; for a
        sparse sensor against a dense one.
    """

    voxel: float | None = None
    density: Literal["keep", "match"] = "keep"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.voxel is not None and not 0.0 < self.voxel < np.inf:
            raise ValueError(f"voxel={self.voxel} must be a positive length in metres")

    def __call__(self, pair: Pair) -> Scene:
        thin = thinned(pair, self.voxel)
        drawn = raised(thin)
        scene = self._scene(thinned(drawn, self.voxel))
        if drawn is not thin:
            scene.note(
                "both clouds are flat 2-D scans: walls were drawn through their points, a floor under their beams"
            )
        for name, cloud, all_of_it in (
            ("source", thin.source, pair.source),
            ("target", thin.target, pair.target),
        ):
            if len(cloud) < len(all_of_it):
                scene.note(f"the {name}'s {len(all_of_it)} points were first thinned to {len(cloud)}")
        return scene

    def _scene(self, pair: Pair) -> Scene:
        clouds = (pair.source, pair.target)
        if self.voxel is None and not comparable(*clouds):
            return _each_by_itself(pair)
        voxel = self.voxel or default_voxel(pair.source, pair.target)
        reached = voxel
        points = side_by_side(partial(_cells, voxel, pair), *SIDES)
        at = [voxel, voxel]
        while self.voxel is None and (most := max(map(len, points))) > _MOST_POINTS:
            voxel = _two_digits_up(voxel * (most / _MOST_POINTS) ** 0.5)
            for k, side in enumerate(SIDES):
                if len(points[k]) > _MOST_POINTS:
                    points[k], at[k] = _cells(voxel, pair, side), voxel
        for k, side in enumerate(SIDES):  # one of few points follows when the voxel is found
            if at[k] != voxel:
                points[k] = _cells(voxel, pair, side)
        spacing = [voxel, voxel]
        if self.density == "match":
            dense = int(np.argmax([len(p) for p in points]))
            points[dense], spacing[dense] = _thin(clouds[dense].points, voxel, len(points[1 - dense]))
        source, target = (
            c.once(
                ("level", s, len(p)), partial(Level, points=p, spacing=s, viewpoint=c.viewpoint)
            )  # no other grid of one spacing has as many cells
            for p, s, c in zip(points, spacing, clouds, strict=True)
        )
        scene = Scene(pair=pair, source=source, target=target)
        if self.voxel is None:
            scene.note(
                f"voxel {voxel:.3g} m, derived from the clouds' extent"
                + (f" ({reached:.3g} m) and the number of points" if voxel > reached else "")
            )
        return scene


def _each_by_itself(pair: Pair) -> Scene:
    # One length for a cloud in millimetres and one in metres would reduce the second to nothing.
    levels = []
    for side in SIDES:
        cloud, voxel = getattr(pair, side), default_voxel(pair.source, pair.target)
        points = voxel_centroids(cloud.points, voxel, side)
        while len(points) > _MOST_POINTS:
            voxel = _two_digits_up(voxel * (len(points) / _MOST_POINTS) ** 0.5)
            points = voxel_centroids(cloud.points, voxel)
        levels.append(Level(points=points, spacing=voxel, viewpoint=cloud.viewpoint))
    source, target = levels
    scene = Scene(pair=pair, source=source, target=target)
    scene.note(
        f"voxels {source.spacing:.3g} and {target.spacing:.3g} m: the clouds' extents differ too much for one"
    )
    return scene


def _cells(voxel: float, pair: Pair, side: Side) -> Array:
    cloud: PointCloud = getattr(pair, side)
    return cloud.once(("cells", voxel), partial(voxel_centroids, cloud.points, voxel, side))


def _two_digits_up(length: float) -> float:
    unit = 10.0 ** (math.floor(math.log10(length)) - 1)
    return float(f"{math.ceil(length / unit) * unit:.2g}")


def _thin(points: Array, voxel: float, n_wanted: int) -> tuple[Array, float]:
    # Bisection on the voxel: the count is monotonic enough for twelve halvings to reach it within a percent.
    low, high = voxel, 16.0 * voxel
    for _ in range(12):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if len(voxel_centroids(points, middle)) > n_wanted else (low, middle)
    return voxel_centroids(points, high), float(high)
