# SPDX-License-Identifier: MIT
"""A few steps of point-to-plane ICP: a rival pose must be judged where it fits best, not where it was guessed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg import se3
from hybridreg.verdict.information import jacobian
from hybridreg.verdict.views import View

Array = NDArray[np.float64]

# Search distances of the steps, in spacings: wide enough to pull in a guess that is some cells off, then tight; and
# for a guess that may be two or three metres off. On a field, where few surfaces pull, a quicker descent comes to rest
# on the way.
_STEPS, _WIDE = (6.0, 4.0, 3.0, 2.0, 2.0), (12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 2.0)
# Width of the weights where the search is wide, per search distance.
_TRUST = 0.25
# Partners that a step takes, at least.
_FEWEST = 30


class Planes(Protocol):
    """What points are laid on: points (n, 3), their KD-tree, and the normals of some rows."""

    @property
    def points(self) -> Array: ...
    @property
    def tree(self) -> cKDTree: ...
    def facing(self, rows: NDArray[np.int64]) -> Array: ...


def settle(
    source: View, target: View, T: Array, spacing: float, *, every: int = 3, wide: bool = False
) -> Array:
    """Pose (4, 4) near T at which the source's settling points lie best on the target's planes.

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
    """Pose (4, 4) that steps of point-to-plane ICP reach from T, until too few `points` (n, 3) have a partner.

    Parameters
    ----------
    steps : pairs of float
        Farthest partner and width of the weights, metres, of each.
    sized : bool
        Fit the size too: the pose is a similarity then.
    """
    for reach, width in steps:
        moved = se3.apply(T, points)
        distance, match = surfaces.tree.query(moved, distance_upper_bound=reach)
        hit = np.isfinite(distance)
        if np.count_nonzero(hit) < _FEWEST:
            return T
        row = np.asarray(match)[hit]
        T = _step_onto(surfaces.points[row], surfaces.facing(row), moved[hit], width, sized) @ T
    return T


def _step_onto(planes: Array, normals: Array, points: Array, width: float, sized: bool) -> Array:
    """Motion (4, 4) of one step of point-to-plane ICP that brings `points` (n, 3) nearer to `planes` through points
    (n, 3) with `normals` (n, 3); `sized`, it makes them larger or smaller too.

    Cauchy weights of `width` metres: half of the neighbours of a wrong guess are no neighbours.
    """
    gap = np.einsum("ni,ni->n", points - planes, normals)
    weight = 1.0 / (1.0 + (gap / width) ** 2)
    centre = points.mean(axis=0)
    arms = points - centre
    J = jacobian(arms, normals)
    if sized:
        J = np.column_stack([J, np.einsum("ni,ni->n", arms, normals)])
    H = (J * weight[:, None]).T @ J
    x = -np.linalg.solve(H + 1e-6 * np.trace(H) * np.eye(J.shape[1]), J.T @ (weight * gap))
    step = se3.about(centre, se3.rotation_about(x[:3]), x[3:6])
    if not sized:
        return step
    grow = np.eye(4)
    grow[:3, :3] *= 1.0 + x[6]
    grow[:3, 3] = -x[6] * centre
    return step @ grow
