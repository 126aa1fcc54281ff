# SPDX-License-Identifier: MIT
"""A few steps of point-to-plane ICP: a rival pose must be judged where it fits best, not where it was guessed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.evidence.information import jacobian
from hybridreg.evidence.views import View
from hybridreg.geometry import se3
from hybridreg.runtime.cores import query_threads

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Search distances of the steps, in spacings: wide enough to pull in a guess that is some cells off, then tight; and
# for a guess that may be two or three metres off. On a field, where few surfaces pull, a quicker descent comes to rest
# on the way.
_STEPS, _WIDE = (6.0, 4.0, 3.0, 2.0, 2.0), (12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 2.0)
# Width of the weights where the search is wide, per search distance.
_TRUST = 0.25
# Partners that a step takes, at least.
_FEWEST = 30


class Planes(Protocol):
    """What points are laid on: points (n, 3), their KD-tree, and the normals (..., 3) of rows (...)."""

    @property
    def points(self) -> Array: ...
    @property
    def tree(self) -> cKDTree: ...
    def facing(self, rows: NDArray[np.int64]) -> Array: ...


def settle(
    source: View, target: View, T: Array, spacing: float, *, every: int = 3, wide: bool = False
) -> Array:
    """Poses (..., 4, 4) near those of T at which the source's settling points lie best on the target's planes.

    Many at once take a third of the time that they take one by one.

    Parameters
    ----------
    every : int
        So many-th of the settling points are used.
    wide : bool
        Look for partners from twice as far, and trust far ones more at first.
    """
    steps = [
        (step * spacing, spacing * (max(1.0, _TRUST * step) if wide else 1.0))
        for step in (_WIDE if wide else _STEPS)
    ]
    return descend(T, source.points[source.settling[::every]], target, steps)


def descend(
    T: Array, points: Array, surfaces: Planes, steps: Iterable[tuple[float, float]], *, sized: bool = False
) -> Array:
    """Poses (..., 4, 4) that steps of point-to-plane ICP reach from T, until too few `points` (n, 3) have a partner.

    Parameters
    ----------
    steps : pairs of float
        Farthest partner and width of the weights, metres, of each.
    sized : bool
        Fit the size too: the poses are similarities then.
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
        step = _step_onto(surfaces.points[row], surfaces.facing(row), moved, hit, width, sized)
        poses[moving] = step @ poses[moving]
    return poses.reshape(np.shape(T))


def _step_onto(planes: Array, normals: Array, points: Array, hit: Mask, width: float, sized: bool) -> Array:
    """Motions (b, 4, 4) of one step of point-to-plane ICP that bring those `points` (b, n, 3) that `hit` (b, n) marks
    nearer to `planes` through points (b, n, 3) with `normals` (b, n, 3); `sized`, they make them larger or smaller too.

    Cauchy weights of `width` metres: half of the neighbours of a wrong guess are no neighbours.
    """
    gap = np.einsum("bni,bni->bn", points - planes, normals)
    weight = hit / (1.0 + (gap / width) ** 2)
    centre = np.einsum("bn,bni->bi", hit, points) / np.count_nonzero(hit, axis=1)[:, None]
    arms = points - centre[:, None]
    J = jacobian(arms, normals)
    if sized:
        J = np.concatenate([J, np.einsum("bni,bni->bn", arms, normals)[..., None]], axis=-1)
    weighted = np.swapaxes(J * weight[..., None], 1, 2)
    H = weighted @ J
    damping = 1e-6 * np.trace(H, axis1=1, axis2=2)[:, None, None] * np.eye(J.shape[-1])
    x = -np.linalg.solve(H + damping, weighted @ gap[..., None])[..., 0]
    step = se3.about(centre, se3.rotation_about(x[:, :3]), x[:, 3:6])
    if not sized:
        return step
    grow = np.tile(np.eye(4), (len(x), 1, 1))
    grow[:, :3, :3] *= 1.0 + x[:, 6, None, None]
    grow[:, :3, 3] = -x[:, 6:] * centre
    return step @ grow
