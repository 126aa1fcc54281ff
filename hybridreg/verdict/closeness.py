# SPDX-License-Identifier: MIT
"""How closely the points of one cloud lie on the surfaces of the other, measured against the sensors' noise.

Along a corridor many poses bring walls onto walls within a surface's tolerance. At the right one the points lie on them
to a centimetre or two, those on door frames and kerbs too; at a wrong one some centimetres beside. That takes surfaces
as fine as the clouds show them, so it is asked only where several poses explain the data.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg import normals, se3
from hybridreg.cloud import PointCloud
from hybridreg.extent import bounds
from hybridreg.resources import n_workers
from hybridreg.scene import Scene
from hybridreg.verdict.settle import descend

Array = NDArray[np.float64]

# Metres: grid of the surfaces, noise of a range, and farthest partner. A grid has so many cells along an axis at most.
_CELL, _NOISE, _NEAR = 0.02, 0.03, 0.5
_MOST_CELLS = 2**20
# Points from which a normal is found; points of a cloud that make surfaces, and that are asked about, at most.
_NEIGHBOURS, _MOST, _ASKED = 15, 100_000, 1_500
# Of the steps of settling: farthest partner, metres; width of the weights per distance, at least the noise; points.
_REACHES, _TRUST, _SETTLING = (0.5, 0.35, 0.25, 0.15, 0.1), 0.25, 600
# Share of the near points that lie anywhere: on what moved, or was seen from one side only.
_ANYWHERE = 0.2
# Points looked at for nothing, added to every count: so few close points are a coincidence.
_FEW = 20.0


class Surfaces(NamedTuple):
    """One cloud, as fine as it is: points (n, 3) with normals and their KD-tree, and points (m, 3) that are asked
    about."""

    points: Array
    normals: Array
    tree: cKDTree
    asked: Array


def closeness(scene: Scene, T_target_source: Array, every: int = 1) -> float:
    """Nats per point by which a right pose explains the distances across the surfaces better than chance does.

    The log-likelihood of the points that have a partner near by, most of which lie on its surface but for noise, over
    that of points which lie anywhere near; of the two clouds the greater, as sparse rings make poor surfaces.

    Parameters
    ----------
    T_target_source : (4, 4)
    every : int
        So many-th of the points are asked about.
    """

    def look() -> float:
        source, target = _both(scene)
        return max(
            _one_way(source.asked[::every], target, T_target_source),
            _one_way(target.asked[::every], source, se3.inverse(T_target_source)),
        )

    return scene.shared(("verdict", "closeness", every, T_target_source.tobytes()), look)


def settle_closely(scene: Scene, T_target_source: Array) -> Array:
    """Pose (4, 4) near by at which the source's points lie best on the target's surfaces as fine as these are."""
    source, target = _both(scene)
    steps = [(reach, max(_NOISE, _TRUST * reach)) for reach in _REACHES]
    return descend(T_target_source, source.asked[:_SETTLING], target, steps)


def _both(scene: Scene) -> tuple[Surfaces, Surfaces]:
    def make() -> tuple[Surfaces, Surfaces]:
        with ThreadPoolExecutor(min(2, n_workers())) as pool:
            source, target = pool.map(_surfaces, (scene.pair.source, scene.pair.target))
            return source, target

    return scene.shared(("verdict", "fine surfaces"), make)


def _surfaces(cloud: PointCloud) -> Surfaces:
    from hybridreg.classical.voxel import voxel_centroids

    rng = np.random.default_rng(0)
    points = cloud.points
    if len(points) > _MOST:
        points = points[np.sort(rng.permutation(len(points))[:_MOST])]
    low, high = bounds(points)
    points = voxel_centroids(points, max(_CELL, float((high - low).max()) / _MOST_CELLS))
    return Surfaces(
        points,
        normals.estimate(points, cloud.viewpoint, _NEIGHBOURS),
        cKDTree(points, balanced_tree=False, compact_nodes=False),
        points[rng.permutation(len(points))[:_ASKED]],
    )


def _one_way(asked: Array, other: Surfaces, T_other_asked: Array) -> float:
    moved = se3.apply(T_other_asked, asked)
    distance, match = other.tree.query(moved, distance_upper_bound=_NEAR)
    near = np.isfinite(distance)
    row = match[near]
    across = np.einsum("ni,ni->n", moved[near] - other.points[row], other.normals[row])
    # Of distances up to _NEAR: a half-normal one of the noise, or any.
    on_it = np.sqrt(2.0 / np.pi) / _NOISE * np.exp(-0.5 * (across / _NOISE) ** 2)
    nats = np.log((1.0 - _ANYWHERE) * on_it * _NEAR + _ANYWHERE)
    return float(nats.sum() / (len(nats) + _FEW))
