# SPDX-License-Identifier: MIT
"""Steps of point-to-plane ICP (Chen and Medioni 1992) with robust weights, for many poses at once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.geometry import se3
from hybridreg.runtime.cores import query_threads

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Correspondences that a step needs, at least.
_FEWEST = 30


class Planes(Protocol):
    """The planes that points are fitted to: points (n, 3), their KD-tree, and the normals (..., 3) of rows (...)."""

    @property
    def points(self) -> Array: ...
    @property
    def tree(self) -> cKDTree: ...
    def facing(self, rows: NDArray[np.int64]) -> Array: ...


def descend(
    T: Array,
    points: Array,
    surfaces: Planes,
    steps: Iterable[tuple[float, float]],
) -> Array:
    """Poses (..., 4, 4) that steps of point-to-plane ICP reach from T, until too few `points` (n, 3) have a
    correspondence.

    Parameters
    ----------
    steps : pairs of float
        Maximum correspondence distance and width of the weights, metres, of each step.
    """
    poses = np.array(T, dtype=np.float64).reshape(-1, 4, 4)
    moving = np.arange(len(poses))
    for reach, width in steps:
        moved = se3.apply(poses[moving], points)  # (b, n, 3)
        threads = query_threads(moved.size // 3)
        distance, match = surfaces.tree.query(moved, distance_upper_bound=reach, workers=threads)
        hit = np.isfinite(distance)
        enough = np.count_nonzero(hit, axis=1) >= _FEWEST
        moving, moved, hit = moving[enough], moved[enough], hit[enough]
        if len(moving) == 0:
            break
        row = np.where(hit, match[enough], 0)
        step = _step_onto(surfaces.points[row], surfaces.facing(row), moved, hit, width)
        poses[moving] = step @ poses[moving]
    return poses.reshape(np.shape(T))


def _step_onto(planes: Array, normals: Array, points: Array, hit: Mask, width: float) -> Array:
    """Motions (b, 4, 4) of one step of point-to-plane ICP that move those `points` (b, n, 3) that `hit` (b, n) marks
    towards the `planes` through points (b, n, 3) with `normals` (b, n, 3).

    Cauchy weights of `width` metres: at a wrong guess half of the nearest neighbours are not true correspondences.
    """
    gap = np.einsum("bni,bni->bn", points - planes, normals)
    weight = hit / (1.0 + (gap / width) ** 2)
    centre = np.einsum("bn,bni->bi", hit, points) / np.count_nonzero(hit, axis=1)[:, None]
    J = jacobian(points - centre[:, None], normals)
    weighted = np.swapaxes(J * weight[..., None], 1, 2)
    H = weighted @ J
    damping = 1e-6 * np.trace(H, axis1=1, axis2=2)[:, None, None] * np.eye(6)
    x = -np.linalg.solve(H + damping, weighted @ gap[..., None])[..., 0]
    return se3.about(centre, se3.rotation_about(x[:, :3]), x[:, 3:])


def jacobian(arms: Array, normals: Array) -> Array:
    """Derivatives (..., 6) of point-to-plane distances by a small rotation and a translation; `arms` (..., 3) from the
    centre."""
    return np.concatenate([np.cross(arms, normals), normals], axis=-1)
