# SPDX-License-Identifier: MIT
"""Two flat 2-D scans, raised to what the sensors would have seen of the same place in three dimensions.

A line of points has no surface, no ground and no side that faces a sensor: nothing that a pose could be found or
judged by. But what a 2-D scan says is plain: where a beam ended stands a wall, and before it there is nothing but
floor. So walls are drawn through the points, and a floor under the beams. Both lie alike over the plane of either scan,
which holds the pose in that plane and says nothing about where.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud
from hybridreg.geometry.extent import reach, sample
from hybridreg.pair import Pair
from hybridreg.resolution import default_voxel

Array = NDArray[np.float64]

# Farthest that nearly all points, and the sensor, lie off the plane of a flat scan: of the cloud's extent; by hand.
_THIN = 1e-3
_NEARLY_ALL = 0.98
# Points that tell whether a scan is flat: a share that is estimated from them is within half a percent.
_TOLD = 5_000
# The sensor's height over the floor, and the walls' over the sensor: of the smaller cloud's extent; by hand.
_HEIGHT = 1.0 / 6.0
# Points through which walls are drawn, at most: a scan seldom has more, a cloud that was flattened has; by hand.
_WALLS = 5_000
# Beams under which floor is drawn, at most; by hand.
_BEAMS = 3_000
# Without beams: points of floor beside each point, and how far beside it, steps; by hand.
_BESIDE, _ASIDE = 12, 8.0
# Unevenness of the floor, steps, to either side, another one for each cloud: of two even floors the last digits would
# pass for a relief that they have in common; by hand.
_UNEVEN = 0.1


def raised(pair: Pair) -> Pair:
    """The pair, both of its clouds with walls and floor where both are flat scans; as it is otherwise."""
    source_up = _normal(pair.source)
    target_up = None if source_up is None else _normal(pair.target)
    if source_up is None or target_up is None:
        return pair
    height = _HEIGHT * min(reach(cloud.radii) for cloud in (pair.source, pair.target))
    step = default_voxel(pair.source, pair.target)
    return pair.replaced(
        source=_raised(pair.source, source_up, height, step, np.random.default_rng(0)),
        target=_raised(pair.target, target_up, height, step, np.random.default_rng(1)),
        drawn=True,
    )


def _normal(cloud: PointCloud) -> Array | None:
    # Unit normal (3,) of the plane that holds the points and their sensors, its largest part positive; None without
    # one. Of a map that no sensor saw, the plane of the points.
    extent = reach(cloud.radii)
    if extent <= 0.0:
        return None
    rows = sample(np.arange(len(cloud)), _TOLD)
    rays = cloud.points[rows] - (
        _places(cloud, rows) if len(cloud.seen.places) else cloud.points.mean(axis=0)
    )
    normal: Array = np.linalg.eigh(rays.T @ rays)[1][:, 0]
    normal = normal * np.sign(normal[np.argmax(np.abs(normal))])
    off = np.abs(rays @ normal)
    return normal if float(np.quantile(off, _NEARLY_ALL)) < _THIN * extent else None


def _places(cloud: PointCloud, rows: NDArray[np.int64]) -> Array:
    # Where points (k,) were seen from, (k, 3) or (1, 3).
    places, of_point, _ = cloud.seen
    return places if of_point is None else places[of_point[rows]]


def _raised(cloud: PointCloud, up: Array, height: float, step: float, rng: np.random.Generator) -> PointCloud:
    levels = np.arange(-height, height + 0.5 * step, step)
    some = sample(np.arange(len(cloud)), _WALLS)
    walls = (cloud.points[some] + levels[:, None, None] * up).reshape(-1, 3)
    beneath, below = (
        _under_beams(cloud, step) if len(cloud.seen.places) else _beside(cloud, some, up, step, rng)
    )
    lift = _UNEVEN * step * rng.uniform(-1.0, 1.0, len(below)) - height
    # The cloud's own points first: what the caller says of its rows stays true.
    points = np.concatenate([cloud.points, walls, beneath + lift[:, None] * up])
    points.setflags(write=False)
    seen = cloud.seen
    if seen.of_point is not None:
        rows = np.concatenate([np.arange(len(cloud)), np.tile(some, len(levels)), below])
        seen = seen._replace(of_point=seen.of_point[rows])
    return replace(cloud, points=points, said=seen, kept=None if cloud.kept is None else {})


def _under_beams(cloud: PointCloud, step: float) -> tuple[Array, NDArray[np.int64]]:
    # At every step along each beam, up to where it ended; and the row of its point.
    some = np.sort(np.random.default_rng(0).permutation(len(cloud))[:_BEAMS])
    places = np.broadcast_to(_places(cloud, some), (len(some), 3))
    beams = cloud.points[some] - places
    length = np.linalg.norm(beams, axis=1)
    n = (length / step).astype(np.int64)
    beam = np.repeat(np.arange(len(beams)), n)
    along = step * (1 + np.arange(len(beam)) - np.repeat(np.cumsum(n) - n, n))
    return places[beam] + beams[beam] * (along / length[beam])[:, None], some[beam]


def _beside(
    cloud: PointCloud, some: NDArray[np.int64], up: Array, step: float, rng: np.random.Generator
) -> tuple[Array, NDArray[np.int64]]:
    # At random to either side of each point: one of the two was in some sensor's view.
    rows = np.repeat(some, _BESIDE)
    aside = _ASIDE * step * rng.uniform(-1.0, 1.0, (len(rows), 3))
    return cloud.points[rows] + aside - (aside @ up)[:, None] * up, rows
