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
from hybridreg.geometry.viewpoint import Seen
from hybridreg.pair import Pair
from hybridreg.resolution import default_voxel

Array = NDArray[np.float64]

# Farthest that a point, or the sensor, lies off the plane of a flat scan: of the cloud's extent. Drivers write zeros.
_THIN = 1e-4
# The sensor's height over the floor, and the walls' over the sensor: of the smaller cloud's extent; by hand.
_HEIGHT = 1.0 / 6.0
# Beams under which floor is drawn, at most; by hand.
_BEAMS = 3_000
# Unevenness of the floor, steps, to either side, another one for each cloud: of two even floors the last digits would
# pass for a relief that they have in common; by hand.
_UNEVEN = 0.1


def raised(pair: Pair) -> Pair:
    """The pair, both of its clouds with walls and floor where both are flat scans; as it is otherwise."""
    ups = [_normal(cloud) for cloud in (pair.source, pair.target)]
    if ups[0] is None or ups[1] is None:
        return pair
    height = _HEIGHT * min(reach(cloud.radii) for cloud in (pair.source, pair.target))
    step = default_voxel(pair.source, pair.target)
    return pair.with_clouds(
        _raised(pair.source, ups[0], height, step, np.random.default_rng(0)),
        _raised(pair.target, ups[1], height, step, np.random.default_rng(1)),
    )


def _normal(cloud: PointCloud) -> Array | None:
    # Unit normal (3,) of the plane that holds all points and the sensor, its largest part positive; None without one.
    place = cloud.viewpoint
    if place is None or place.ndim > 1:
        return None
    rays = cloud.points - place
    extent = reach(cloud.radii)
    if extent <= 0.0:
        return None
    normal: Array = np.linalg.eigh(rays.T @ rays)[1][:, 0]
    normal = normal * np.sign(normal[np.argmax(np.abs(normal))])
    return normal if float(np.abs(rays @ normal).max()) < _THIN * extent else None


def _raised(cloud: PointCloud, up: Array, height: float, step: float, rng: np.random.Generator) -> PointCloud:
    # The cloud's own points first: what the caller says of its rows stays true.
    place = cloud.seen.places[0]
    levels = np.arange(-height, height + 0.5 * step, step)
    walls = (cloud.points[None] + levels[:, None, None] * up).reshape(-1, 3)
    beams = sample(cloud.points, _BEAMS) - place
    length = np.linalg.norm(beams, axis=1)
    n = np.maximum((length / step).astype(np.int64), 0)
    # At every step along each beam, up to where it ended.
    beam = np.repeat(np.arange(len(beams)), n)
    along = step * (1 + np.arange(len(beam)) - np.repeat(np.cumsum(n) - n, n))
    under = height + _UNEVEN * step * rng.uniform(-1.0, 1.0, len(beam))
    floor = place + beams[beam] * (along / length[beam])[:, None] - under[:, None] * up
    points = np.concatenate([cloud.points, walls, floor])
    points.setflags(write=False)
    said = Seen(cloud.seen.places, None, cloud.seen.words)
    return replace(cloud, points=points, said=said, kept=None if cloud.kept is None else {})
