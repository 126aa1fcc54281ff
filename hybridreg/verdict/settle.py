# SPDX-License-Identifier: MIT
"""A few steps of point-to-plane ICP: a rival pose must be judged where it fits best, not where it was guessed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
_FEWEST = 30


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
    rows = source.settling[::every]
    for step in _WIDE if wide else _STEPS:
        moved = se3.apply(T, source.points[rows])
        distance, match = target.tree.query(moved, distance_upper_bound=step * spacing)
        hit = np.isfinite(distance)
        if np.count_nonzero(hit) < _FEWEST:
            return T
        points, match = moved[hit], np.asarray(match)[hit]
        normals = target.normals[match]
        gap = np.einsum("ni,ni->n", points - target.points[match], normals)
        # Cauchy weights: half of the neighbours of a wrong guess are no neighbours.
        width = spacing * max(1.0, _TRUST * step) if wide else spacing
        weight = 1.0 / (1.0 + (gap / width) ** 2)
        centre = points.mean(axis=0)
        J = jacobian(points - centre, normals)
        H = (J * weight[:, None]).T @ J
        twist = -np.linalg.solve(H + 1e-6 * np.trace(H) * np.eye(6), J.T @ (weight * gap))
        T = se3.about(centre, se3.rotation_about(twist[:3]), twist[3:]) @ T
    return T
