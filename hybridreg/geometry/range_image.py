# SPDX-License-Identifier: MIT
"""Range image of a cloud: how far its sensor saw in each direction, and which places it saw as free.

A grid of rows and columns suits one kind of sensor in one orientation. Here the directions themselves are the
image: returns thinned to cells of equal angle on the sphere, and a KD-tree over them. It works alike for rings, fans,
rosettes and hemispheres, upright or not, and a rotated cloud gives the same results. `RangeImage.look` tells
which points of the other cloud lie where this sensor saw through: free-space violations (docs/methods.md 12.1).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.geometry.extent import radii
from hybridreg.geometry.extent import reach as reach_of
from hybridreg.geometry.voxel_cells import distinct_keys
from hybridreg.runtime.cores import query_threads

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_FINEST = np.radians(0.5)  # cell: below half a degree two clouds cannot be compared anyway
_COARSEST = np.radians(4.0)  # cell: above four degrees a few stray returns would count as a field of view
# Cells are as wide as the gaps between returns when doubling them covers less than this much more of the sky. It
# would be 1 for a sharp-edged field of view with even rings; uneven rings and ragged edges add to it.
_FILLED = 1.5
_BITS = 12  # of a cell's index along one axis
# Beyond this angle of incidence a surface is seen edge-on, degrees: a ray beside the point that continues may graze
# the same surface far behind it. Most ground is seen like this.
_EDGE_ON_DEG = 75.0
# Cells along a cloud's extent, as in `hybridreg.resolution`.
_CELLS_ALONG_REACH = 60.0
# Viewpoints of a cloud, at most: each has its own image.
_MOST_PLACES = 8
# Two returns of one cell whose ranges differ by less than this share lie on one surface.
_ONE_SURFACE = 0.1


class Seen(IntEnum):
    """What a sensor says about a place."""

    UNSEEN = 0  # it did not look there, or got no return
    SEEN = 1  # it got a return from there
    FREE = 2  # a free-space violation for a point here: the ray continued and hit something behind
    HIDDEN = 3  # something in front of it was hit


@dataclass(frozen=True, eq=False)
class RangeImage:
    """Returns of one cloud by direction.

    Attributes
    ----------
    viewpoint : (3,) float64
    directions : (n, 3) float64, unit length
    ranges : (n,) float64, metres
    resolution : float
        Angle between neighbouring rays across the widest regular gap (between rings), radians.
    """

    viewpoint: Array
    directions: Array
    ranges: Array
    resolution: float
    tree: cKDTree

    @classmethod
    def of(cls, points: Array, viewpoint: Array) -> RangeImage:
        """Image of `points` (N, 3) about `viewpoint` (3,).

        Raises
        ------
        ValueError
            If all points lie at the viewpoint.
        """
        ray = points - viewpoint
        reach = np.sqrt(np.einsum("ni,ni->n", ray, ray))
        apart = reach > 1e-6
        if not apart.any():
            raise ValueError("range image: every point lies at the viewpoint")
        if not apart.all():
            points, ray, reach = points[apart], ray[apart], reach[apart]
        finest = _finest(points, reach)
        directions, reach, cells = _thin(ray / reach[:, None], reach, finest)
        resolution = _resolution(cells, finest)
        if resolution > 2.0 * finest:
            directions, reach, _ = _thin(directions, reach, 0.5 * resolution)
        tree = cKDTree(directions, balanced_tree=False, compact_nodes=False)
        return cls(np.asarray(viewpoint, dtype=np.float64), directions, reach, resolution, tree)

    def look(
        self, points: Array, normals: Array | None = None, *, margin: float, reach: float = np.inf, k: int = 4
    ) -> NDArray[np.int8]:
        """Whether this sensor saw each point (m, 3), saw free space there, or could not tell.

        Parameters
        ----------
        normals : (m, 3) or None
            Of the surfaces that the points lie on; without them an angle of incidence of 45 degrees is assumed.
        margin : float
            Metres by which two ranges of one surface may differ.
        reach : float
            Metres that the surface extends sideways from a point. A ray that passes the point at a larger distance
            might miss the surface, and says nothing.
        k : int
            Nearest rays that are compared. One that ends at the point is enough for SEEN; all must continue behind it
            for FREE, so that a ray beside a narrow object is no violation. For a surface seen edge-on no ray gives
            FREE.

        Returns
        -------
        (m,) int8 of `Seen`
        """
        ray = points - self.viewpoint
        r = np.maximum(np.sqrt(np.einsum("ni,ni->n", ray, ray)), 1e-9)
        k = min(k, len(self.ranges))
        angle, index = self.tree.query(
            ray / r[:, None],
            k=np.arange(1, k + 1),
            distance_upper_bound=1.5 * self.resolution,
            workers=query_threads(len(r)),
        )
        sideways = r[:, None] * angle
        asked = np.isfinite(angle) & (sideways <= reach)
        behind = self.ranges[np.minimum(index, len(self.ranges) - 1)] - r[:, None]
        slope, edge_on = _slope(ray / r[:, None], normals)
        slack = margin + np.where(asked, sideways, 0.0) * slope[:, None]
        seen = (asked & (np.abs(behind) <= slack)).any(axis=1)
        through = ~(asked & (behind <= slack)).any(axis=1)
        beyond = np.where(edge_on, Seen.UNSEEN, Seen.FREE)
        state = np.where(seen, Seen.SEEN, np.where(through, beyond, Seen.HIDDEN))
        return np.where(asked.any(axis=1), state, Seen.UNSEEN).astype(np.int8)


@dataclass(frozen=True, eq=False)
class RangeImages:
    """Range images of a cloud with several viewpoints, each of the points seen from there."""

    images: tuple[RangeImage, ...]

    @classmethod
    def of(cls, points: Array, places: Array, of_point: Integers) -> RangeImages:
        """Images of `points` (N, 3) from those viewpoints `places` (k, 3) that saw most points.

        `of_point` (N,) is the row of each point's viewpoint.
        """
        counts = np.bincount(of_point, minlength=len(places))
        most = [int(k) for k in np.argsort(-counts, kind="stable")[:_MOST_PLACES] if counts[k] > 0]
        return cls(tuple(RangeImage.of(points[of_point == k], places[k]) for k in most))

    def look(
        self, points: Array, normals: Array | None = None, *, margin: float, reach: float = np.inf, k: int = 4
    ) -> NDArray[np.int8]:
        """As for one image: seen or free where any sensor says so, hidden only where none does."""
        states = np.stack(
            [image.look(points, normals, margin=margin, reach=reach, k=k) for image in self.images]
        )
        told = [(states == state).any(axis=0) for state in (Seen.SEEN, Seen.FREE, Seen.HIDDEN)]
        return np.select(told, [Seen.SEEN, Seen.FREE, Seen.HIDDEN], Seen.UNSEEN).astype(np.int8)


def _finest(points: Array, ranges: Array) -> float:
    # Half the angle of the cells in which clouds are compared: far finer for a small object seen from near than for a
    # street.
    some = points[:: max(1, len(points) // 5_000)]
    cell = reach_of(radii(some)) / _CELLS_ALONG_REACH
    return float(np.clip(0.5 * cell / float(np.median(ranges)), 2.0 / (1 << _BITS) * 1.01, _FINEST))


def angular_resolution(directions: Array, finest: float = _FINEST) -> float:
    """Angle in radians at which cells on the sphere are as wide as the gaps between returns (n, 3).

    While cells are finer than the gaps between rings, doubling them doubles the part of the sky that counts as
    seen; once they are wider it hardly grows. The doubling stops there.
    """
    return _resolution(distinct_keys(_cells(directions, finest)), finest)


def _resolution(cells: Integers, angle: float) -> float:
    while angle < _COARSEST:
        coarser = distinct_keys(_merged(cells))
        if 4 * len(coarser) < _FILLED * len(cells):
            break
        angle, cells = 2 * angle, coarser
    return float(angle)


def _cells(directions: Array, angle: float) -> Integers:
    # A cube grid intersected with the sphere: the same in every orientation up to a factor, no poles, no seam.
    x, y, z = ((np.ascontiguousarray(directions.T) + 1.0) / angle).astype(np.int64)
    return (x << 2 * _BITS) | (y << _BITS) | z


def _merged(cells: Integers) -> Integers:
    mask = (1 << _BITS) - 1
    x, y, z = cells >> 2 * _BITS, (cells >> _BITS) & mask, cells & mask
    return ((x >> 1) << 2 * _BITS) | ((y >> 1) << _BITS) | (z >> 1)


def _thin(directions: Array, ranges: Array, angle: float) -> tuple[Array, Array, Integers]:
    # Returns that stand for their cells, and the occupied cells, rising. One number to sort by: the cell, then the
    # range in steps of a 16-millionth.
    steps = (ranges * ((2.0**24 - 1) / ranges.max())).astype(np.int64)
    cell = _cells(directions, angle)
    order = np.argsort((cell << 24) | steps)
    change = np.flatnonzero(np.diff(cell[order]))
    near = order[np.concatenate([[0], change + 1])]
    far = order[np.concatenate([change, [len(order) - 1]])]
    # The farthest return too where it lies on another surface: a cell on an edge must represent both.
    kept = np.concatenate([near, far[ranges[far] > (1.0 + _ONE_SURFACE) * ranges[near]]])
    return directions[kept], ranges[kept], cell[near]


def _slope(rays: Array, normals: Array | None) -> tuple[Array, NDArray[np.bool_]]:
    # How much the range of a surface changes per metre sideways: the tangent of the angle of incidence; and whether
    # the surface is seen edge-on.
    if normals is None:
        return np.ones(len(rays)), np.zeros(len(rays), dtype=bool)
    cosine = np.abs(np.einsum("ni,ni->n", rays, normals))
    least = np.cos(np.radians(_EDGE_ON_DEG))
    edge_on = cosine < least
    cosine = np.maximum(cosine, least)
    return np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / cosine, edge_on
