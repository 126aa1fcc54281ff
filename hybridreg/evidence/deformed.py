# SPDX-License-Identifier: MIT
"""A pose that may also deform the source, strain it or lengthen its ranges, so that it lies on the target as closely as
it can."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.surface_distance import Surfaces, one_way
from hybridreg.evidence.views import View, Views
from hybridreg.geometry import se3
from hybridreg.geometry.point_to_plane import jacobian

Array = NDArray[np.float64]

# Farthest partners of the rough steps, spacings; by hand.
_ROUGHLY = (8.0, 8.0, 6.0, 6.0, 4.0, 4.0, 3.0, 3.0, 2.0, 2.0)
# Farthest partners of the fine steps, shares of the fine surfaces' own; by hand.
_CLOSELY = (1.0, 0.6, 0.4)
# Points that take part; by hand.
_POINTS = 700
# Correspondences that a step needs, at least.
_FEWEST = 30
# Width of the weights per farthest partner; by hand.
_TRUST = 0.25
# Metres; points nearer to the sensor have no direction.
_NEAR = 1e-6

NO_STRAIN = np.zeros((0, 3, 3))


class Deformed(NamedTuple):
    """`T` (4, 4), affine, maps the source's points to the target once `offset` metres are added to their ranges."""

    T: Array
    offset: float = 0.0


def fit(views: Views, T_target_source: Array, strains: Array, *, ranges: bool = False) -> Deformed:
    """The deformation near a pose (4, 4) that fits best.

    Parameters
    ----------
    strains : (k, 3, 3)
        Symmetric matrices, in the frame of the target, whose combination is fitted: the identity scales the points, a
        product d d^T stretches them along d.
    ranges : bool
        Whether an offset of all the source's ranges is fitted too.
    """
    source, target = views.fine
    rough = views.source.points[views.source.settling[:_POINTS]]
    close = source.asked[:_POINTS]
    found = Deformed(T_target_source)
    for points, surfaces, noise, reaches in (
        (rough, views.target, views.spacing, views.spacing * np.array(_ROUGHLY)),
        (close, target, target.noise, target.far * np.array(_CLOSELY)),
    ):
        rays = directions(points, views.source) if ranges else None
        for reach in reaches:
            found = _step(found, points, rays, surfaces, strains, reach, max(noise, _TRUST * reach))
    return found


def closeness_of(views: Views, found: Deformed) -> float:
    """Nats per point by which the deformed source lies closer to the target's surfaces than by chance."""
    source, target = views.fine
    moved = source.asked
    if found.offset:
        moved = moved + found.offset * directions(moved, views.source)
    return one_way(moved, target, found.T)


def directions(points: Array, view: View) -> Array:
    """Unit vectors (n, 3) from where the cloud was seen from to its points (n, 3)."""
    rays = points - view.centre
    return rays / np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), _NEAR)


def _step(
    found: Deformed,
    points: Array,
    rays: Array | None,
    surfaces: View | Surfaces,
    strains: Array,
    reach: float,
    width: float,
) -> Deformed:
    # One step of point-to-plane ICP with Cauchy weights of `width`, whose unknowns are the motion, the strains and the
    # offset.
    moved = se3.apply(found.T, points if rays is None else points + found.offset * rays)
    distance, match = surfaces.tree.query(moved, distance_upper_bound=reach)
    hit = np.isfinite(distance)
    if np.count_nonzero(hit) < _FEWEST:
        return found
    moved, row = moved[hit], match[hit]
    normals = surfaces.facing(row)
    gap = np.einsum("ni,ni->n", moved - surfaces.points[row], normals)
    weight = 1.0 / (1.0 + (gap / width) ** 2)
    centre = np.ones(len(moved)) @ moved / len(moved)
    arms = moved - centre
    along = [np.einsum("ni,ni->n", normals @ strain, arms) for strain in strains]
    if rays is not None:
        along.append(np.einsum("ni,ni->n", normals, rays[hit] @ found.T[:3, :3].T))
    J = np.column_stack([jacobian(arms, normals), *along])
    weighted = (J * weight[:, None]).T
    H = weighted @ J
    x = -np.linalg.solve(H + 1e-6 * np.trace(H) * np.eye(len(H)), weighted @ gap)
    strain = np.eye(3) + np.tensordot(x[6 : 6 + len(strains)], strains, axes=1)
    step = se3.about(centre, se3.rotation_about(x[:3]) @ strain, x[3:6])
    return Deformed(step @ found.T, found.offset + (float(x[-1]) if rays is not None else 0.0))
