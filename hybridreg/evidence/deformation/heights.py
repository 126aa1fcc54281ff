# SPDX-License-Identifier: MIT
"""Are the heights of one cloud in another unit, by what is level?

The ground still lies on the ground then, and walls on walls: the pose may look right. Where walls are most of what
there is, as in rooms, the whole lies hardly closer for a stretch (`stretch`). What faces up or down above the ground
tells: more of it agrees once heights over the ground are multiplied.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformation.deformed import Onto
from hybridreg.evidence.deformation.stretch import Stretch
from hybridreg.evidence.views import View, Views
from hybridreg.geometry import se3
from hybridreg.geometry.ground import Ground

Array = NDArray[np.float64]

# What heights are multiplied by; the finer steps about the best of them. By hand: no unit differs by more than a metre
# from a foot, and what lies 4 m over a floor is found within some 4 %.
_FACTORS = 1.06 ** np.arange(-21, 22)
_FINER = np.linspace(0.95, 1.05, 11)
# Factors within this are none; by hand.
_LEAST = 0.07
# Times as many points, and so many more, must agree, and this share of those looked at; by hand. Of 18 real pairs and
# 350 right poses of `sim:val` and hard kinds with even seeds none is told.
_TIMES, _MORE, _SHARE = 1.4, 12, 0.1
# Metres over the ground from which a point is a thing's, and thicknesses of the ground; by hand.
_OFF, _THICK = 0.4, 4.0
_UPRIGHT = 0.7  # cosine of the angle between a level surface's normal and the vertical, at least; by hand
# Spacings within which a point has a partner, and off its plane within which it agrees; by hand.
_REACH, _ACROSS = 2.0, 0.4
_ASKED, _FEWEST = 500, 30  # points that are looked at, at most and at least: for speed, and by hand
# Points of either cloud that are looked at first, and times as many of them that must agree: for speed.
_FIRST, _PROMISING = 150, 1.15


def heights(views: Views, T_target_source: Array) -> Stretch | None:
    """The factor of the source's heights about a pose (4, 4); None where it is one, where neither cloud shows its
    ground, or hardly anything is level above it."""
    source, target = (view.ground for view in (views.source, views.target))
    T_source_target = se3.inverse(T_target_source)
    source = source or (None if target is None else _moved(target, T_source_target))
    target = target or (None if source is None else _moved(source, T_target_source))
    if source is None or target is None:
        return None
    onto = Onto.target(views), Onto.source(views)
    ways = [
        _Way.of(onto[0], source, target, T_target_source),
        _Way.of(onto[1], target, source, T_source_target),
    ]
    asked = sum(len(way.heights) for way in ways)
    if asked < _FEWEST:
        return None

    def agreeing(factor: float, of: int = _ASKED) -> int:
        return ways[0].agreeing(factor, of) + ways[1].agreeing(1.0 / factor, of)

    best = float(max(_FACTORS, key=lambda factor: agreeing(factor, _FIRST)))
    if agreeing(best, _FIRST) <= _PROMISING * agreeing(1.0, _FIRST):
        return None
    best = float(max(best * _FINER, key=agreeing))
    if abs(best - 1.0) < _LEAST or agreeing(best) < max(_TIMES * agreeing(1.0) + _MORE, _SHARE * asked):
        return None
    return Stretch(best, target.up, 1.0)


class _Way(NamedTuple):
    # Points (n, 3) of one cloud's level surfaces above its ground, as the pose lays them once its ground lies on the
    # other's ground, their `heights` (n,), and the direction (3,) along which these are measured.
    points: Array
    heights: Array
    up: Array
    onto: Onto
    ground: Ground

    @classmethod
    def of(cls, onto: Onto, own: Ground, other: Ground, T: Array) -> _Way:
        view = onto.moved
        heights, up = own.above(view.points), T[:3, :3] @ own.up
        level = np.abs(view.normals @ own.up) > _UPRIGHT
        high = heights > _off(onto, view)
        rng = np.random.default_rng(0)
        rows, below = (rng.permutation(np.flatnonzero(level & which))[:_ASKED] for which in (high, ~high))
        way = cls(se3.apply(T, view.points[rows]), heights[rows], up, onto, other)
        gap = way._gaps(se3.apply(T, view.points[below]), above=False)
        return way._replace(points=way.points - (np.median(gap) if len(gap) else 0.0) * up)

    def agreeing(self, factor: float, of: int) -> int:
        moved = self.points[:of] + np.outer((factor - 1.0) * self.heights[:of], self.up)
        return int(np.count_nonzero(np.abs(self._gaps(moved, above=True)) < _ACROSS * self.onto.spacing))

    def _gaps(self, moved: Array, *, above: bool) -> Array:
        # Metres by which those of `moved` (n, 3) with a partner lie over its level surface, above the ground or on it.
        other = self.onto.other
        distance, match = other.tree.query(moved, distance_upper_bound=_REACH * self.onto.spacing)
        near = np.isfinite(distance)
        moved, row = moved[near], match[near]
        partners, normals = other.points[row], other.facing(row)
        steep = normals @ self.up
        high = self.ground.above(partners) > _off(self.onto, other)
        fits = (np.abs(steep) > _UPRIGHT) & (high == above)
        gaps = np.einsum("ni,ni->n", moved - partners, normals) * np.sign(steep)
        return np.asarray(gaps[fits])


def _moved(ground: Ground, T: Array) -> Ground:
    up = T[:3, :3] @ ground.up
    return Ground(up, ground.height + float(up @ T[:3, 3]))


def _off(onto: Onto, view: View) -> float:
    return max(_OFF * onto.fine.scale, _THICK * view.thickness)
