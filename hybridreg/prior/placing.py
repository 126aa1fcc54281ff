# SPDX-License-Identifier: MIT
"""Clouds moved, made larger, and cut to a region, each with the places it was seen from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hybridreg import gate
from hybridreg.cloud import PointCloud
from hybridreg.geometry import se3

Array = NDArray[np.float64]

# Coordinates from which the rounded part of a motion goes into the cloud's offset, metres: as a map grid's.
_FAR = 1e4


def moved(cloud: PointCloud, T: Array) -> PointCloud:
    """A cloud under a rigid motion (4, 4) of the user's coordinates; where it was seen from moves along."""
    if np.array_equal(T, np.eye(4)):
        return cloud
    # The cloud's points are small numbers and its offset a large one: they must not be added up on the way.
    shift = T[:3, :3] @ cloud.offset + T[:3, 3]
    offset = np.where(np.abs(shift) > _FAR, np.round(shift, -3), 0.0)
    own = se3.from_rt(T[:3, :3], shift - offset)
    seen = cloud.seen
    return PointCloud(
        points=_fixed(se3.apply(own, cloud.points)),
        sensor=cloud.sensor,
        offset=offset,
        dropped=cloud.dropped,
        said=seen._replace(places=se3.apply(own, seen.places)),
    )


def sized(cloud: PointCloud, scale: float) -> PointCloud:
    """A cloud `scale` times as large about the origin of the user's coordinates."""
    if scale == 1.0:
        return cloud
    seen = cloud.seen
    return replace(
        cloud,
        points=_fixed(cloud.points * scale),
        offset=cloud.offset * scale,
        said=seen._replace(places=seen.places * scale),
        guess=None,
    )


def within_box(cloud: PointCloud, box: Array, name: str) -> PointCloud:
    """The points in a box (6,), its lowest corner and its highest one, in the user's coordinates.

    Raises
    ------
    ValueError
        Fewer remain than a pose needs.
    """
    low, high = box[:3] - cloud.offset, box[3:] - cloud.offset
    words = f"crop: the box of {_corner(low + cloud.offset)} to {_corner(high + cloud.offset)}"
    inside = np.asarray(((cloud.points >= low) & (cloud.points <= high)).all(axis=1))
    return _kept(cloud, inside, name, words)


def within_radius(cloud: PointCloud, middle: Array, radius: float, name: str) -> PointCloud:
    """The points nearer to a place (3,) of the user's coordinates than so many metres, seen from above: the height of
    the place is not asked for.

    Raises
    ------
    ValueError
        Fewer remain than a pose needs.
    """
    away = (cloud.points - (middle - cloud.offset))[:, :2]
    words = f"crop: within {radius:g} m of {_corner(middle)}"
    return _kept(cloud, np.hypot(away[:, 0], away[:, 1]) <= radius, name, words)


def _kept(cloud: PointCloud, rows: NDArray[np.bool_], name: str, words: str) -> PointCloud:
    count = int(rows.sum())
    if count < gate.MIN_POINTS:
        low, high = cloud.bounds
        raise ValueError(
            f"{name}: {words} holds {count} of its {len(cloud)} points, fewer than {gate.MIN_POINTS}; they lie between "
            f"{_corner(low + cloud.offset)} and {_corner(high + cloud.offset)}, choose a region there"
        )
    seen = cloud.seen  # of the whole cloud: a part tells less of where it was seen from
    return replace(cloud, points=_fixed(cloud.points[rows]), said=seen.of(rows), guess=None)


def _fixed(points: Array) -> Array:
    points.setflags(write=False)
    return points


def _corner(place: Array) -> str:
    return "(" + ", ".join(f"{x:.6g}" for x in place) + ")"
