# SPDX-License-Identifier: MIT
"""Where a cloud was seen from: one viewpoint, several, or none that is known.

Free space, the side of a surface and "up" follow from it, so it is never assumed. What the user or a data set says is
taken. Otherwise the viewpoint in the file, or the origin of its frame, is tested: from where a sensor stood,
neighbouring rays end on one surface; from anywhere else (a map's origin, a vehicle's axle) they mix surfaces that lie
behind one another.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.geometry import ground
from hybridreg.geometry.extent import radii, reach
from hybridreg.geometry.voxel_cells import distinct_keys

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
# What a caller may give: "auto" tests the origin, "none" (or None) is no viewpoint at all, one viewpoint, or several
# with each point's row among them.
Given = Any

_DIFFER = 1.2  # ratio of neighbouring ranges from which they differ; by hand
# Share of neighbouring rays that differ, at most: up to 0.17 from the viewpoints of 52 sensors, real and simulated,
# raw and thinned to 0.25 m; 0.2 to 0.6 from the ground under 45 of them.
_MOST_JUMPS = 0.18
_ASKED = 2_000  # rays that are compared; by hand
_RAYS = 30_000  # rays sampled for that; by hand
_CELL = 0.1  # radians: cells of which the sampled rays fill some completely; by hand
# A cloud that fills a narrower cone (radians) does not show where it was seen from.
_NARROWEST = np.radians(4.0)
# Least height of a sensor over the ground; by hand.
_LOWEST = 0.15  # metres
_OF_REACH = 0.05  # of the cloud's extent, at most
# Seen from this many least heights up, less than this share of the jumps remain if the origin lies in the ground.
_LIFT = 10.0  # by hand
_FEWER = 0.6  # by hand
_FLAT = 0.95  # share of points on one plane above which it is a single beam's scan, not ground; by hand
_FEWEST = 20  # points of a ground that give its height; by hand


_ORIGIN = "the origin of its frame"


class Seen(NamedTuple):
    """Where a cloud was seen from, in its own frame.

    places : (k, 3) float64; empty where it is not known, or there is no single viewpoint
    of_point : (N,) int64 or None, row of each point's viewpoint where there are several
    words : how that is known
    """

    places: Array
    of_point: Integers | None
    words: str

    def of(self, rows: NDArray[np.bool_] | None) -> Seen:
        """The viewpoints of a subset of the points, rows (N,)."""
        kept = self.of_point if self.of_point is None or rows is None else self.of_point[rows]
        return self._replace(of_point=kept)

    def less(self, offset: Array) -> Seen:
        """The same viewpoints minus the cloud's offset (3,)."""
        return self._replace(places=self.places - offset)


def given(value: Given, n_points: int, name: str) -> Seen | None:
    """What a caller gave for `n_points` points; None where the origin is to be tested.

    Parameters
    ----------
    value : "auto", "none", None, (3,), (N, 3), or a pair of (k, 3) places and (N,) integer rows of them

    Raises
    ------
    ValueError
        Anything else, naming the cloud and what was given.
    """
    if isinstance(value, str) and value == "auto":
        return None
    if value is None or (isinstance(value, str) and value == "none"):
        return Seen(np.zeros((0, 3)), None, "no sensor's place, as given")
    try:
        if isinstance(value, (tuple, list)) and len(value) == 2:
            places, rows = np.array(value[0], dtype=np.float64), np.array(value[1])
        else:
            places, rows = np.array(value, dtype=np.float64), None
    except (TypeError, ValueError):
        raise _refused(value, n_points, name) from None
    if rows is None and places.shape == (n_points, 3):
        places, rows = np.unique(places, axis=0, return_inverse=True)
        rows = np.ravel(rows)
    if places.shape == (3,):
        places = places[None]
    several = rows is not None and rows.shape == (n_points,) and rows.dtype.kind in "iu" and len(places) > 0
    if places.ndim != 2 or places.shape[1:] != (3,) or not np.isfinite(places).all() or len(places) == 0:
        raise _refused(value, n_points, name)
    if rows is not None and not (several and rows.min() >= 0 and rows.max() < len(places)):
        raise _refused(value, n_points, name)
    if rows is None and len(places) > 1:
        raise _refused(value, n_points, name)
    if len(places) == 1:
        rows = None
    return Seen(places, None if rows is None else rows.astype(np.int64), "as given")


def _refused(value: Given, n_points: int, name: str) -> ValueError:
    return ValueError(
        f'{name}: viewpoint must be "auto", "none", one place (x, y, z), a place for each of the {n_points} points, '
        f"or a pair of places (k, 3) and the row of each point's, finite and in metres; got {_short(value)}"
    )


def _short(value: Given) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 80 else text[:77] + "..."


def found(points: Array, place: Array | None = None) -> Seen:
    """The origin of the frame of `points` (N, 3), or the viewpoint `place` (3,) in their file, if a sensor may have
    stood there; otherwise none, and why."""
    if place is None:
        against = _against_origin(points)
        return Seen(np.zeros((0, 3)), None, against) if against else Seen(np.zeros((1, 3)), None, _ORIGIN)
    against = _against_origin(points - place).replace("its origin", "the viewpoint in its file")
    return Seen(np.zeros((0, 3)), None, against) if against else Seen(place[None], None, "as its file says")


def _against_origin(points: Array) -> str:
    directions, distances = _rays(points)
    middle = np.array([column.mean() for column in directions.T])  # by column: a tenth of the time
    length = float(np.linalg.norm(middle))
    if length > np.cos(_NARROWEST) and float(np.quantile(directions @ middle / length, 0.1)) > np.cos(
        _NARROWEST
    ):
        return "its origin lies far away from it"
    jumps = differing(directions, distances)
    if jumps > _MOST_JUMPS:
        return f"seen from its origin, {jumps:.0%} of neighbouring points lie behind one another"
    return _against_height(points, jumps)


def _rays(points: Array) -> tuple[Array, Array]:
    distances = np.sqrt(np.einsum("ni,ni->n", points, points))
    apart = distances > 1e-6 * float(distances.max())
    if not apart.all():
        points, distances = points[apart], distances[apart]
    return points / distances[:, None], distances


def differing(directions: Array, distances: Array) -> float:
    """Share of the rays (n, 3) that end on a different surface than the neighbouring ray, by their `distances` (n,)."""
    rng = np.random.default_rng(0)
    if len(directions) > _RAYS:
        # Whole patches of the sphere, as thinned rays would be farther apart.
        cells = ((directions + 1.0) / _CELL).astype(np.int64) @ np.array([1, 1_000, 1_000_000])
        order = rng.permutation(distinct_keys(cells))
        kept = np.isin(cells, order[: max(1, len(order) * _RAYS // len(cells))])
        directions, distances = directions[kept], distances[kept]
    if len(directions) < 2:
        return 0.0
    asked = rng.permutation(len(directions))[:_ASKED]
    tree = cKDTree(directions, balanced_tree=False, compact_nodes=False)
    beside = tree.query(directions[asked], k=2)[1][:, 1]
    a, b = distances[asked], distances[beside]
    return float(np.mean(np.maximum(a, b) > _DIFFER * np.minimum(a, b)))


def _against_height(points: Array, jumps: float) -> str:
    some = points[:: max(1, len(points) // _RAYS)]
    far = reach(radii(some))
    plane = ground.under(some, None, 0.01 * far)
    if plane is None:
        return ""
    lowest = min(_LOWEST, _OF_REACH * far)
    on_it = some[np.abs(plane.above(some)) < 2.0 * lowest]
    if len(on_it) < _FEWEST or len(on_it) > _FLAT * len(some):
        return ""
    # The ground nearby, as it rises and falls farther away.
    distance = np.einsum("ni,ni->n", on_it, on_it)
    near = on_it[np.argsort(distance)[: max(_FEWEST, len(on_it) // 20)]]
    height = -float(np.median(near @ plane.up))
    # The top of a hedge may look like ground; but it does not look smoother from higher up.
    if abs(height) >= lowest or differing(*_rays(points - _LIFT * lowest * plane.up)) > _FEWER * jumps:
        return ""
    return f"its origin lies in the ground ({height:+.2f} m over it)"


def centre(points: Array, viewpoint: Array | None) -> Array:
    """Where points (n, 3) were seen from, (3,): the middle of several places; of the points where none is known."""
    if viewpoint is None:
        middle: Array = np.median(points, axis=0)
        return middle
    return viewpoint if viewpoint.ndim == 1 else viewpoint.mean(axis=0)
