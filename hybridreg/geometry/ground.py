# SPDX-License-Identifier: MIT
"""The ground of one cloud, however its sensor was mounted; also of a map, which no single sensor saw."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.geometry.extent import radii, reach

if TYPE_CHECKING:
    pass

Array = NDArray[np.float64]
Weights = NDArray[np.float64]

# Half the thickness of the ground, as a plane follows uneven ground only so well; by hand.
_THICK = 0.25  # metres, at most
_OF_REACH = 0.03  # of the cloud's extent, at most (rooms)
_SPACINGS = 0.6  # spacings, at least
# Metres: where all points lie in one place the above are zero.
_THIN = 1e-9
_TRIPLES = 4000  # of points, tried; by hand
_LOOKED_AT = 120  # of them that are best on `_FEW` points; by hand
_FITTED = 6  # of these that are best on `_MANY`; by hand
_FEW = 160  # points, by hand
_MANY = 1500  # points, by hand
_AT_ONCE = 512  # planes whose heights over `_FEW` points fit in a core's cache
# Least share of the cloud on the ground, minus the share below it.
_LEAST = 0.1
# A steep plane, or one far from the sensor, is more often a wall than the ground (in a lane the walls have several
# times as many points). Sensors are more often upright than upside down. All by hand.
_STEEP_DEG = 40.0  # degrees from level
_STEEP = 0.15  # factor on the score of a steep plane
_FAR_METRES = 5.0  # metres below the sensor
_FAR = 0.5  # factor on the score of a plane farther below
_UPTURNED = 0.9  # factor on the score of a plane above the sensor's xy-plane
# Share of a cloud's points that lie level on the other side of a room, at least. Over 15 streets it is at most 0.002
# (hard kind "upside-down", even seeds), in 11 rooms, tunnels and maps of buildings 0.017 at least.
_BOUND = 0.008
_LEVEL = 0.9  # cosine of the angle between a level surface's normal and up; by hand
_LOW_ROOM = 6.0  # thicknesses between floor and ceiling, at least; by hand


class Ground(NamedTuple):
    """A level plane: `up` (3,) unit, towards the sensor; `height` metres of the plane along it."""

    up: Array
    height: float

    @property
    def upright(self) -> bool:
        """Whether its sensor's z axis, or that of its map, points up."""
        return bool(self.up[2] > np.cos(np.radians(_STEEP_DEG)))

    def above(self, points: Array) -> Array:
        """Heights (n,) of points (n, 3) over the ground, metres."""
        return points @ self.up - self.height

    @property
    def levelling(self) -> Array:
        """(3, 3): the shortest turn that brings `up` to z."""
        return se3.turn_to_z(self.up)


def under(points: Array, viewpoint: Array | None, spacing: float) -> Ground | None:
    """Ground of `points` (n, 3), or None where no plane carries enough of them.

    A search over planes through three points, with a fixed seed: the plane with most points on it and few below, near
    points counting more (far ground rises and falls). The sensor may be mounted in any orientation; where two planes
    compete, the one under an upright sensor wins.

    Parameters
    ----------
    viewpoint : (3,), (k, 3) or None
        Where the sensor stood, on the upper side of the ground. Without it, up is where the other points are.
    spacing : float
        Metres between neighbouring points.
    """
    if len(points) < 3:
        return None
    rng = np.random.default_rng(0)
    middle = np.median(points, axis=0) if viewpoint is None else np.atleast_2d(viewpoint).mean(axis=0)
    points = points[rng.permutation(len(points))[: 4 * _MANY]] - middle
    seen = viewpoint is not None
    weights = _nearer_more(points)
    thick = thickness(points, spacing)
    ups, heights = _planes(points, rng, seen)
    for n, kept in ((_FEW, _LOOKED_AT), (_MANY, _FITTED)):
        scores = _scores(points[:n], weights[:n], ups, heights, thick, seen)
        best = np.argsort(-scores, kind="stable")[:kept]
        ups, heights = ups[best], heights[best]
    found = [_fitted(points, weights, up, float(h), thick, seen) for up, h in zip(ups, heights, strict=True)]
    if not found:
        return None
    ups, heights = np.array([g.up for g in found]), np.array([g.height for g in found])
    scores = _scores(points, weights, ups, heights, thick, seen)
    best_one = int(np.argmax(scores))
    up, height = found[best_one]
    # Where no plane competes, a steep one needs no more points than any other.
    if scores[best_one] < _LEAST * (_STEEP if _steep(up) else 1.0):
        return None
    return Ground(up, height + float(up @ middle))


def facing(points: Array, normals: Array, found: Ground, spacing: float) -> Ground | None:
    """The level surface on the other side of `points` (n, 3) with `normals` (n, 3): the ceiling over a floor, or the
    floor under what was taken for the ground. None in the open."""
    thick, up = thickness(points, spacing), -found.up
    rise = np.sort(points[np.abs(normals @ up) > _LEVEL] @ up)
    if len(rise) == 0:
        return None
    heights = np.arange(rise[0], -found.height - _LOW_ROOM * thick, 0.5 * thick)
    if len(heights) == 0:
        return None
    below, up_to = np.searchsorted(rise, [heights - thick, heights + thick])
    on_it = up_to - 2 * below  # less those below it: a floor is lower than a table
    best = int(np.argmax(on_it))
    if on_it[best] < _BOUND * len(points):
        return None
    return Ground(up, float(np.median(rise[below[best] : up_to[best]])))


def thickness(points: Array, spacing: float) -> float:
    """Half the thickness of a cloud's ground, metres: a plane follows uneven ground only so well."""
    return max(_SPACINGS * spacing, min(_THICK, _OF_REACH * reach(radii(points))), _THIN)


def _nearer_more(points: Array) -> Weights:
    square = np.sum(points**2, axis=1)
    weights = 1.0 / (1.0 + square / max(float(np.median(square)), 1e-30))
    return weights / weights.sum()


def _planes(points: Array, rng: np.random.Generator, seen: bool) -> tuple[Array, Array]:
    # Planes through three points, normals towards the sensor, which is at the origin; both signs where it is not known.
    a, b, c = points[rng.integers(0, len(points), (3, _TRIPLES))]
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1)
    good = length > 1e-12 * np.max(length, initial=1e-30)
    ups = normals[good] / length[good, None]
    heights = np.einsum("ni,ni->n", ups, a[good])
    if not seen:
        return np.concatenate([ups, -ups]), np.concatenate([heights, -heights])
    above = np.where(heights > 0.0, -1.0, 1.0)
    return ups * above[:, None], heights * above


def _scores(points: Array, weights: Weights, ups: Array, heights: Array, thick: float, seen: bool) -> Weights:
    weights, share = weights / weights.sum(), np.empty(len(ups))
    planes = np.column_stack([ups, heights]) / thick
    lifted = np.vstack([points.T, -np.ones(len(points))])
    for first in range(0, len(ups), _AT_ONCE):
        above = planes[first : first + _AT_ONCE] @ lifted  # (B, n)
        # 1 on the plane, -1 below it.
        on_it = (above < 1.0).astype(np.int8) - (above <= -1.0) - (above < -2.0)
        share[first : first + _AT_ONCE] = on_it @ weights
    likely = np.where(_steep(ups), _STEEP, 1.0)
    likely *= np.where(-heights > _FAR_METRES, _FAR, 1.0) if seen else 1.0
    return share * likely * np.where(ups[:, 2] < 0.0, _UPTURNED, 1.0)


def _steep(up: Array) -> Any:
    # For one plane (3,) or many (k, 3).
    return np.abs(up[..., 2]) < np.cos(np.radians(_STEEP_DEG))


def _fitted(points: Array, weights: Weights, up: Array, height: float, thick: float, seen: bool) -> Ground:
    for width in (2.0, 1.0, 1.0):
        on = np.abs(points @ up - height) < width * thick
        if np.count_nonzero(on) < 3:
            break
        some, share = points[on], weights[on]
        centre = share @ some / share.sum()
        centred = some - centre
        normal = np.linalg.eigh((share[:, None] * centred).T @ centred)[1][:, 0]
        turned = normal @ centre > 0.0 if seen else normal @ up < 0.0
        up = -normal if turned else normal
        height = float(up @ centre)
    return Ground(up, height)
