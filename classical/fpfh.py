# SPDX-License-Identifier: MIT
"""Matches by fast point feature histograms (Rusu et al. 2009)."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.nearest_descriptors import nearest
from hybridreg.matches import Correspondences, Overlap
from hybridreg.runtime.open3d import load_open3d
from hybridreg.scene import SIDES, Scene, Side
from hybridreg.stage import Stage

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# In spacings. Five is usual; sparse scans need more to distinguish neighbourhoods.
_RADIUS = 8.0
# An overlap mask that leaves fewer points than this is considered wrong, and ignored.
_FEWEST = 100
# Of a superpoint's cell, in spacings: as coarse as the published networks' superpoints are against their first voxel.
_CELL = 16.0


@dataclass(frozen=True, kw_only=True)
class Fpfh(Stage):
    """Match points whose neighbourhoods look alike.

    Descriptors are those of Open3D, on normals that point to the sensor; they are compared by the Hellinger
    distance, as histograms should be (Arandjelovic and Zisserman 2012). The defaults were chosen on simulated
    pairs of different LiDARs, where both the distance and the wide radius increase the inlier ratio.

    Parameters
    ----------
    radius : float or None
        Of a neighbourhood, metres. None takes 8 times the scene's spacing.
    max_neighbours : int
        At most this many points of a neighbourhood are used, the nearest ones.
    normal_neighbours : int
        Points that a normal is fitted to.
    mutual : bool
        Keep a match only where each point is the other's nearest.
    ratio : float in (0, 1] or None
        Keep a match only where its distance is below this share of the distance to the second nearest. None
        keeps all: on points a voxel apart the second nearest is often the next point of the same surface.
    min_overlap : float in [0, 1]
        Points with a lower probability of overlap are left out, unless too few would remain.
    max_points : int
        A cloud with more points to match is thinned to so many at random; noted in the result.
    cell : float or None
        Edge, metres, of the cells that stand for superpoints: matches between the same two cells are one group, from
        which local-to-global estimation makes a pose. None takes 16 times the scene's spacing.
    """

    radius: float | None = None
    max_neighbours: int = 150
    normal_neighbours: int = 30
    mutual: bool = True
    ratio: float | None = None
    min_overlap: float = 0.5
    max_points: int = 50_000
    cell: float | None = None

    gives: ClassVar[frozenset[str]] = frozenset({"matches", "group"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.radius is not None and not self.radius > 0.0:
            raise ValueError(f"radius={self.radius} must be a positive length in metres")
        if self.cell is not None and not self.cell > 0.0:
            raise ValueError(f"cell={self.cell} must be a positive length in metres")
        if self.ratio is not None and not 0.0 < self.ratio <= 1.0:
            raise ValueError(f"ratio={self.ratio} must lie in (0, 1]")
        if not 0.0 <= self.min_overlap <= 1.0:
            raise ValueError(f"min_overlap={self.min_overlap} must lie in [0, 1]")
        for name in ("max_neighbours", "normal_neighbours", "max_points"):
            if getattr(self, name) < 3:
                raise ValueError(f"{name}={getattr(self, name)} must be at least 3")

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        features = [self.features(scene, side) for side in SIDES]
        rows = [
            self._rows(scene, side, f, probability)
            for side, f, probability in zip(SIDES, features, (overlap.source, overlap.target), strict=True)
        ]
        if min(len(r) for r in rows) == 0:
            return Correspondences.none()
        found = nearest(features[0][rows[0]], features[1][rows[1]])
        keep = found.mutual if self.mutual else np.ones(len(rows[0]), dtype=bool)
        if self.ratio is not None:
            keep = keep & (found.distance < self.ratio * found.second)
        source_index, target_index = rows[0][keep], rows[1][found.row[keep]]
        source, target = scene.source.points[source_index], scene.target.points[target_index]
        return Correspondences(
            source=source,
            target=target,
            group=_groups(source, target, self.cell or _CELL * scene.spacing),
            weight=np.ones(len(source_index)),
            source_index=source_index,
            target_index=target_index,
        )

    def features(self, scene: Scene, side: Side) -> Array:
        """Descriptors (n, 33) of a level's points: roots of histograms, zero where there is no neighbour."""
        level = scene.level(side)
        radius = self.radius or _RADIUS * scene.spacing
        normals = level.normals(self.normal_neighbours)
        key = ("fpfh", radius, self.max_neighbours, self.normal_neighbours)
        return level.once(key, lambda: _fpfh(level.points, normals, radius, self.max_neighbours))

    def _rows(self, scene: Scene, side: Side, features: Array, probability: Array) -> Indices:
        # A descriptor of zeros belongs to a point without neighbours, and equals all others like it.
        described = features.any(axis=1)
        rows = np.flatnonzero(described & (probability > self.min_overlap))
        if len(rows) < min(_FEWEST, int(described.sum())):
            scene.note(f"only {len(rows)} points of the {side} lie in the overlap: FPFH matched all points")
            rows = np.flatnonzero(described)
        if len(rows) > self.max_points:
            scene.note(f"FPFH matched {self.max_points} of the {len(rows)} points of the {side} (max_points)")
            # The sample depends on the pair alone, so that a matcher needs no generator.
            rng = np.random.default_rng(zlib.crc32(f"{scene.pair.id} {side}".encode()))
            rows = np.sort(rng.choice(rows, self.max_points, replace=False))
        return rows


def _groups(source: Array, target: Array, cell: float) -> Indices:
    """Which matches (K, 3) to (K, 3) join the same two cells, (K,), numbered from 0."""
    pairs = np.floor(np.hstack([source, target]) / cell)
    group: Indices = np.unique(pairs, axis=0, return_inverse=True)[1].reshape(-1)
    return group


def _fpfh(points: Array, normals: Array, radius: float, max_neighbours: int) -> Array:
    o3d = load_open3d()
    # Copies, because Open3D refuses arrays that are read-only, as a cloud's are.
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points.copy()))
    cloud.normals = o3d.utility.Vector3dVector(normals.copy())
    search = o3d.geometry.KDTreeSearchParamHybrid(radius, max_neighbours)
    histograms = np.asarray(o3d.pipelines.registration.compute_fpfh_feature(cloud, search).data).T
    return np.sqrt(np.maximum(np.nan_to_num(histograms), 0.0))
