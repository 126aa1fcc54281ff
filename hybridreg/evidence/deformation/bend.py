# SPDX-License-Identifier: MIT
"""Do parts of a map lie better elsewhere than where the pose lays the whole?

A map that was put together from many scans drifts: it bends, sags, or grows too long. A pose may lie right in its
middle, and metres off at its ends. So the clouds are cut into parts along what they share, and each is laid anew.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformation.deformed import FEWEST, TRUST, Onto
from hybridreg.evidence.surface_distance import one_way
from hybridreg.evidence.views import View, Views
from hybridreg.geometry import se3
from hybridreg.geometry.point_to_plane import descend
from hybridreg.geometry.range_image import RangeImage
from hybridreg.resolution import Tolerance, tolerance

Array = NDArray[np.float64]

# Parts along what the clouds share; by hand.
_PARTS = 4
# Farthest partners of the steps, spacings, and from there on shares of the fine surfaces' own; by hand.
_ROUGHLY, _CLOSELY = (12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 2.0), (1.0, 0.7, 0.5, 0.3, 0.2)
# Spacings within which a point has a partner under the pose, so that it belongs to what is shared; by hand.
_SHARED = 8.0
# Nats per point that a part must gain, of all its points or of those that stand on the ground, and tolerances by which
# it must move, laid onto the other cloud and the other way round: by hand. Of 36 right poses of maps (hard kinds with
# even seeds) that would not fail otherwise none moves by more than 0.55 both ways; of 18 made maps that bend by 5
# degrees and more, have a kink of 3 and more, or sag by 2 m, 16 by more than 1.
_GAIN, _HARM = 0.1, 0.8
# Degrees; a part that turns farther does not lie better, it found something else.
_FARTHEST = 20.0


class Bend(NamedTuple):
    """By how many `degrees` and `metres` that part which lies farthest off would lie better."""

    degrees: float
    metres: float


def bend(views: Views, T_target_source: Array) -> Bend | None:
    """The bend about a pose (4, 4); None where there is none, or where each cloud was taken by one sensor from one
    place, whose scan does not bend."""
    if all(isinstance(view.image, RangeImage) for view in (views.source, views.target)):
        return None
    allowed = tolerance(views.scene.pair.source, views.scene.pair.target)
    found = []
    for onto, T in (
        (Onto.target(views), T_target_source),
        (Onto.source(views), se3.inverse(T_target_source)),
    ):
        off = [one for one in _parts(onto, T) if one.metres > _HARM * allowed.metres]
        if not off:
            return None
        found.append(max(off, key=lambda one: one.metres))
    least = min(found, key=lambda one: one.metres)
    return Bend(least.degrees, least.metres)


def _parts(onto: Onto, T: Array) -> list[Tolerance]:
    # How far away each part lies better, of those that do.
    moved = onto.moved
    points = moved.points[moved.settling]
    partners = onto.other.tree.query(se3.apply(T, points), distance_upper_bound=_SHARED * onto.spacing)[0]
    points = points[np.isfinite(partners)]
    if len(points) < _PARTS * FEWEST:
        return []
    along = _longest(moved, points)
    ends = np.quantile(points @ along, np.linspace(0.0, 1.0, _PARTS + 1))
    part, part_of_fine = (np.searchsorted(ends[1:-1], each @ along) for each in (points, onto.fine.asked))
    found = (_laid(onto, T, points[part == k], onto.fine.asked[part_of_fine == k]) for k in range(_PARTS))
    return [one for one in found if one is not None and one.degrees < _FARTHEST]


def _longest(view: View, points: Array) -> Array:
    # Direction (3,) in which points extend farthest, on the level where that is known.
    arms = points - points.mean(axis=0)
    if view.ground is not None:
        arms = arms - np.outer(arms @ view.ground.up, view.ground.up)
    longest: Array = np.linalg.eigh(arms.T @ arms)[1][:, -1]
    return longest


def _laid(onto: Onto, T: Array, points: Array, fine: Array) -> Tolerance | None:
    if min(len(points), len(fine)) < FEWEST:
        return None
    moved, surfaces, spacing = onto.moved, onto.other_fine, onto.spacing
    roughly = descend(T, points, onto.other, [(k * spacing, max(1.0, TRUST * k) * spacing) for k in _ROUGHLY])
    reaches = surfaces.far * np.array(_CLOSELY)
    closely = descend(roughly, fine, surfaces, [(r, max(surfaces.noise, TRUST * r)) for r in reaches])
    standing = fine if moved.ground is None else fine[np.abs(moved.ground.above(fine)) > spacing]
    lots = [(lot, one_way(lot, surfaces, T)) for lot in (fine, standing) if len(lot) >= FEWEST]

    def gain(to: Array) -> float:
        return max(one_way(lot, surfaces, to) - as_it_is for lot, as_it_is in lots)

    better = max((roughly, closely), key=gain)
    if gain(better) < _GAIN:
        return None
    return Tolerance.between(T, better, se3.apply(T, points.mean(axis=0, keepdims=True))[0])
