# SPDX-License-Identifier: MIT
"""A pose that may also deform the cloud that is moved, so that it lies on the other as closely as it can."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.surface_distance import Surfaces, one_way
from hybridreg.evidence.views import View, Views
from hybridreg.geometry import se3
from hybridreg.geometry.point_to_plane import jacobian
from hybridreg.resolution import Tolerance
from hybridreg.scene import Side

Array = NDArray[np.float64]
# Displacements (k, n, 3) of points (n, 3), by one unit of each of k amounts.
Field = Callable[[Array], Array]

# Farthest partners of the rough steps, spacings; by hand.
_ROUGHLY = (8.0, 8.0, 6.0, 6.0, 4.0, 4.0, 3.0, 3.0, 2.0, 2.0)
# Farthest partners of the fine steps, shares of the fine surfaces' own; by hand.
_CLOSELY = (1.0, 0.6, 0.4)
# Points that take part; by hand.
POINTS = 700
# Correspondences that a step needs, at least.
FEWEST = 30
# Width of the weights per farthest partner; by hand.
TRUST = 0.25

NO_STRAIN = np.zeros((0, 3, 3))


class Onto(NamedTuple):
    """Which of two clouds is `moved` and laid onto the `other`, each as a view and as fine surfaces."""

    moved: View
    other: View
    fine: Surfaces
    other_fine: Surfaces
    spacing: float

    @classmethod
    def target(cls, views: Views) -> Onto:
        """The source is moved."""
        return cls(views.source, views.target, *views.fine, views.spacing)

    @classmethod
    def source(cls, views: Views) -> Onto:
        """The target is moved."""
        source, target = views.fine
        return cls(views.target, views.source, target, source, views.spacing)

    @classmethod
    def both_ways(cls, views: Views, T_target_source: Array) -> Iterator[tuple[Side, Onto, Array]]:
        """Which cloud is moved, and the pose (4, 4) that moves it."""
        yield "source", cls.target(views), T_target_source
        yield "target", cls.source(views), se3.inverse(T_target_source)

    def moved_off(self, T: Array, other: Array) -> Tolerance:
        """How far one pose (4, 4) lays the middle of the moved cloud from where another does."""
        middle = self.moved.points.mean(axis=0, keepdims=True)
        return Tolerance.between(T, other, se3.apply(T, middle)[0])


class Deformed(NamedTuple):
    """`T` (4, 4), affine, maps the moved points to the other cloud once `amounts` (k,) of a field are added to them."""

    T: Array
    amounts: Array = np.zeros(0)

    def added(self, points: Array, moves: Array | None) -> Array:
        """Points (n, 3) with their displacements; `moves` (k, n, 3) is what the field says of them."""
        return points if moves is None else points + np.tensordot(self.amounts, moves, axes=1)


def fit(onto: Onto, T: Array, strains: Array = NO_STRAIN, field: Field | None = None) -> Deformed:
    """The deformation near a pose T (4, 4) of the moved cloud that fits best.

    Parameters
    ----------
    strains : (k, 3, 3)
        Symmetric matrices, in the frame of the other cloud, whose combination is fitted: the identity scales the
        points, a product d d^T stretches them along d.
    field : function
        Whose amounts are fitted too.
    """
    found = Deformed(T, np.zeros(0 if field is None else len(field(np.zeros((1, 3))))))
    rough, close = onto.moved.points[onto.moved.settling[:POINTS]], onto.fine.asked[:POINTS]
    for points, surfaces, noise, reaches in (
        (rough, onto.other, onto.spacing, onto.spacing * np.array(_ROUGHLY)),
        (close, onto.other_fine, onto.other_fine.noise, onto.other_fine.far * np.array(_CLOSELY)),
    ):
        moves = None if field is None else field(points)
        for reach in reaches:
            found = _step(found, points, moves, surfaces, strains, reach, max(noise, TRUST * reach))
    return found


def closeness_of(onto: Onto, found: Deformed, field: Field | None = None) -> float:
    """Nats per point by which the deformed cloud lies closer to the other's surfaces than by chance."""
    points = onto.fine.asked
    return one_way(found.added(points, None if field is None else field(points)), onto.other_fine, found.T)


def rigidly(onto: Onto, T: Array) -> float:
    """The same of a pose (4, 4), or of a pose near by that is better."""
    return max(closeness_of(onto, each) for each in (Deformed(T), fit(onto, T)))


def _step(
    found: Deformed,
    points: Array,
    moves: Array | None,
    surfaces: View | Surfaces,
    strains: Array,
    reach: float,
    width: float,
) -> Deformed:
    # One step of point-to-plane ICP with Cauchy weights of `width`, whose unknowns are the motion, the strains and the
    # amounts.
    moved = se3.apply(found.T, found.added(points, moves))
    distance, match = surfaces.tree.query(moved, distance_upper_bound=reach)
    hit = np.isfinite(distance)
    if np.count_nonzero(hit) < FEWEST:
        return found
    moved, row = moved[hit], match[hit]
    normals = surfaces.facing(row)
    gap = np.einsum("ni,ni->n", moved - surfaces.points[row], normals)
    weight = 1.0 / (1.0 + (gap / width) ** 2)
    centre = np.ones(len(moved)) @ moved / len(moved)
    arms = moved - centre
    along = [np.einsum("ni,ni->n", normals @ strain, arms) for strain in strains]
    if moves is not None:
        along.extend(np.einsum("ni,ni->n", normals @ found.T[:3, :3], move[hit]) for move in moves)
    J = np.column_stack([jacobian(arms, normals), *along])
    weighted = (J * weight[:, None]).T
    H = weighted @ J
    x = -np.linalg.solve(H + 1e-6 * np.trace(H) * np.eye(len(H)), weighted @ gap)
    strain = np.eye(3) + np.tensordot(x[6 : 6 + len(strains)], strains, axes=1)
    step = se3.about(centre, se3.rotation_about(x[:3]) @ strain, x[3:6])
    return Deformed(step @ found.T, found.amounts + x[6 + len(strains) :])
