# SPDX-License-Identifier: MIT
"""Parts of a cloud that lie better elsewhere than where a pose lays the whole."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformation.deformed import FEWEST, TRUST, Onto
from hybridreg.evidence.surface_distance import one_way
from hybridreg.evidence.views import View
from hybridreg.geometry import se3
from hybridreg.geometry.point_to_plane import descend
from hybridreg.resolution import Tolerance

Array = NDArray[np.float64]

# Parts along what the clouds share; by hand.
_PARTS = 4
# Farthest partners of the steps, spacings, and from there on shares of the fine surfaces' own; by hand.
_ROUGHLY, _CLOSELY = (12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 2.0), (1.0, 0.7, 0.5, 0.3, 0.2)
# Spacings within which a point has a partner under the pose, so that it belongs to what is shared; by hand.
_SHARED = 8.0
# What a part must gain, nats per point or share of points with a near partner: of all its points, of those that stand
# on the ground, or of those that face along what is shared. And nats per point that all its points may lose for it, as
# none lies better off the surfaces. By hand: of 86 right poses of maps (hard kinds with even seeds) four have a part
# that lies better, none of which would be "ok" otherwise; of 38 poses that lay a quarter of a made map's points beyond
# half a metre, as it bends, sags, slips, or is too long, 32 have one.
_GAIN, _MORE, _LOSS = 0.1, 0.1, 0.5
# Points added to either count of near partners: so few are a coincidence; by hand.
_FEW = 20
# Cosine from which a point faces along what is shared; by hand.
_FACES = 0.7
# Degrees; a part that turns farther does not lie better, it found something else.
_FARTHEST = 10.0


class Part(NamedTuple):
    """A part that lies better at the pose `T` (4, 4), so far `off` where it was laid, at the part's middle."""

    T: Array
    off: Tolerance


def lying_better(onto: Onto, T: Array, starts: Array, metres: float) -> list[Part]:
    """The parts of the moved cloud that lie better farther than some `metres` from where the pose T (4, 4) lays them,
    sought near some `starts` (k, 4, 4)."""
    moved = onto.moved
    points = moved.points[moved.settling]
    partners = onto.other.tree.query(se3.apply(T, points), distance_upper_bound=_SHARED * onto.spacing)[0]
    points = points[np.isfinite(partners)]
    if len(points) < _PARTS * FEWEST:
        return []
    along = _longest(moved, points)
    ends = np.quantile(points @ along, np.linspace(0.0, 1.0, _PARTS + 1))
    lots = points, onto.fine.asked, _standing(onto), _facing(moved, along)
    found = []
    for k in range(_PARTS):
        part, *weighed = (lot[(ends[k] <= lot @ along) & (lot @ along <= ends[k + 1])] for lot in lots)
        centre = se3.apply(T, part.mean(axis=0, keepdims=True))[0]
        for to in laid(onto, starts, part, weighed[0]):
            off = Tolerance.between(T, to, centre)
            if off.metres > metres and off.degrees < _FARTHEST and _better(onto, T, to, weighed):
                found.append(Part(to, off))
                break
    return found


def _longest(view: View, points: Array) -> Array:
    # Direction (3,) in which points extend farthest, on the level where that is known.
    arms = points - points.mean(axis=0)
    if view.ground is not None:
        arms = arms - np.outer(arms @ view.ground.up, view.ground.up)
    longest: Array = np.linalg.eigh(arms.T @ arms)[1][:, -1]
    return longest


def _standing(onto: Onto) -> Array:
    ground, points = onto.moved.ground, onto.fine.asked
    return points[:0] if ground is None else points[np.abs(ground.above(points)) > onto.spacing]


def _facing(view: View, along: Array) -> Array:
    points: Array = view.points[view.asked][np.abs(view.normals[view.asked] @ along) > _FACES]
    return points


def laid(onto: Onto, starts: Array, points: Array, fine: Array) -> list[Array]:
    """Where a part, `points` (n, 3) and as `fine` as the cloud shows it (m, 3), comes to lie from each of some starts
    (k, 4, 4): on fine surfaces, and after that the rough ones; none where it has few points."""
    if min(len(points), len(fine)) < FEWEST:
        return []
    surfaces, spacing = onto.other_fine, onto.spacing
    roughly = descend(
        starts, points, onto.other, [(k * spacing, max(1.0, TRUST * k) * spacing) for k in _ROUGHLY]
    )
    reaches = surfaces.far * np.array(_CLOSELY)
    closely = descend(roughly, fine, surfaces, [(r, max(surfaces.noise, TRUST * r)) for r in reaches])
    return [*closely, *roughly]


def _better(onto: Onto, T: Array, to: Array, lots: list[Array]) -> bool:
    # More closely, or more of them near: where the pose lays a part metres off, few have a partner, by chance.
    surfaces = onto.other_fine
    for k, points in enumerate(lots):
        if len(points) < FEWEST:
            continue
        closer = one_way(points, surfaces, to) - one_way(points, surfaces, T)
        before, after = (np.count_nonzero(surfaces.near(se3.apply(pose, points))) for pose in (T, to))
        if k == 0 and (after < before or closer < -_LOSS):  # of all its points
            return False
        if closer >= _GAIN or after + _FEW >= (1.0 + _MORE) * (before + _FEW):
            return True
    return False
