# SPDX-License-Identifier: MIT
"""Nearest-neighbour matching of point features, shared by the dense matchers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.nearest_descriptors import nearest
from hybridreg.learned.stages.spreading import gather
from hybridreg.matches import Correspondences, Overlap
from hybridreg.scene import Scene

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# An overlap mask that leaves fewer points than this is considered wrong, and ignored.
_FEWEST = 100


@dataclass(frozen=True, eq=False, kw_only=True)
class DensePoints:
    """Points (n, 3) of a cloud in metres, and their features (n, d) for the comparison."""

    points: Array
    features: Array

    def only(self, rows: Indices) -> DensePoints:
        """Some of the points."""
        return DensePoints(points=self.points[rows], features=self.features[rows])


def match_dense(
    scene: Scene,
    overlap: Overlap,
    source: DensePoints,
    target: DensePoints,
    *,
    min_overlap: float,
    mutual: bool,
    spacing: float,
) -> Correspondences:
    """Each source point with the target point of the nearest feature; the weight is their cosine, at least 0.

    Parameters
    ----------
    min_overlap
        Points with a lower probability of overlap are left out, unless too few would remain.
    mutual
        Keep only mutual nearest neighbours.
    spacing
        Of the points, metres.
    """
    levels = ((source, scene.source.points, overlap.source), (target, scene.target.points, overlap.target))
    kept = [cloud.only(_rows(cloud, level, probability, min_overlap)) for cloud, level, probability in levels]
    return match_points(kept[0], kept[1], mutual=mutual, spacing=spacing)


def match_points(
    source: DensePoints, target: DensePoints, *, mutual: bool, spacing: float
) -> Correspondences:
    """All points of the source, as `match_dense`."""
    if not (len(source.points) and len(target.points)):
        return Correspondences.none()
    found = nearest(source.features, target.features)
    first = np.flatnonzero(found.mutual) if mutual else np.arange(len(source.points))
    second = found.row[first]
    cosine = np.sum(unit(source.features[first]) * unit(target.features[second]), axis=1)
    return Correspondences(
        source=source.points[first],
        target=target.points[second],
        weight=np.maximum(cosine, 0.0),
        spacing=spacing,
    )


def _rows(cloud: DensePoints, level: Array, probability: Array, min_overlap: float) -> Indices:
    # A feature that is not finite (of length zero, normalised as published) matches nothing.
    usable = np.isfinite(cloud.features).all(axis=1)
    rows = np.flatnonzero(usable & (gather(probability, level, cloud.points) > min_overlap))
    enough = len(rows) >= min(_FEWEST, len(cloud.points))
    return rows if enough else np.flatnonzero(usable)


def unit(features: Array) -> Array:
    """Features (n, d) of length one."""
    return features / np.maximum(np.linalg.norm(features, axis=1, keepdims=True), 1e-12)
