# SPDX-License-Identifier: MIT
"""Does much of a cloud lie on the other one at a second pose?

A map whose loops were not closed holds a place twice, and a sweep may be put together of two moments: what was decoded
while the vehicle turned, or after packets were lost. A pose is right for one of both layers, and what the other one
shows lies off. It lies as closely once it is moved by itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformation.deformed import FEWEST, Onto
from hybridreg.evidence.deformation.parts import laid
from hybridreg.evidence.surface_distance import Surfaces, one_way
from hybridreg.evidence.views import Views
from hybridreg.geometry import se3
from hybridreg.resolution import Tolerance, tolerance
from hybridreg.scene import Side

Array = NDArray[np.float64]

# Spacings within which a point has a partner under the pose, so that the other cloud shows its surroundings, and
# standard deviations of the noise from which it lies off, and within which it lies on; by hand.
_SHARED, _OFF, _ON = 12.0, 3.0, 2.0
# Share of the shared points that lie off, share of those that lie on once they are moved, and nats per point that they
# gain: by hand. Six made maps that hold a place twice have 0.45, 0.65 and 2.6 at least; of 160 right poses (real,
# `sim:val`, hard kinds with even seeds) none has as much of all three.
_LAYER, _LIES, _GAIN = 0.35, 0.5, 2.4
# Points of the first layer for one of the second, at least, as a pose lies where most does; by hand. Where a map hardly
# shows anything of the other cloud, a few walls find other planes: 54 lie on at a right pose there, and 95 beside.
_AS_MANY = 0.8
# Degrees; what turns farther found something else.
_FARTHEST = 10.0


class SecondLayer(NamedTuple):
    """A `share` of what stands in one cloud lies on the other one so many `degrees` and `metres` away from the rest."""

    side: Side
    share: float
    degrees: float
    metres: float


def second_layer(views: Views, T_target_source: Array) -> SecondLayer | None:
    """The one about a pose (4, 4), of either cloud; None where there is none beyond the tolerance."""
    allowed = tolerance(views.scene.pair.source, views.scene.pair.target)
    tried = (_of(side, onto, T, allowed) for side, onto, T in Onto.both_ways(views, T_target_source))
    return next((one for one in tried if one is not None), None)


def _of(side: Side, onto: Onto, T: Array, allowed: Tolerance) -> SecondLayer | None:
    points, surfaces = _standing(onto), onto.other_fine
    partners = onto.other.tree.query(se3.apply(T, points), distance_upper_bound=_SHARED * onto.spacing)[0]
    shared = points[np.isfinite(partners)]
    if len(shared) < FEWEST:
        return None
    lies_off = _gaps(shared, surfaces, T) > _OFF * surfaces.noise
    off = shared[lies_off]
    if len(off) < max(FEWEST, _LAYER * len(shared)):
        return None
    to = laid(onto, T[None], off, off)[0]
    away = Tolerance.between(T, to, se3.apply(T, off.mean(axis=0, keepdims=True))[0])
    if away.within(allowed) or away.degrees > _FARTHEST:
        return None
    first = np.count_nonzero(~lies_off)
    second = np.count_nonzero(_gaps(off, surfaces, to) < _ON * surfaces.noise)
    if first < _AS_MANY * second or second < _LIES * len(off):
        return None
    if one_way(off, surfaces, to) - one_way(off, surfaces, T) < _GAIN:
        return None
    return SecondLayer(side, second / len(shared), *away)


def _standing(onto: Onto) -> Array:
    # What stands on the ground, as that slides along itself; all points where a cloud shows none.
    points, ground = onto.fine.asked, onto.moved.ground
    return points if ground is None else points[np.abs(ground.above(points)) > onto.spacing]


def _gaps(points: Array, surfaces: Surfaces, T: Array) -> Array:
    # Distances (n,) of points (n, 3) to the planes of their partners; infinite where there is none.
    near, across = surfaces.across(se3.apply(T, points))
    gaps = np.full(len(points), np.inf)
    gaps[near] = np.abs(across)
    return gaps
