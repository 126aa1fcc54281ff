# SPDX-License-Identifier: MIT
"""Default resolution: voxel, map cell and tolerance of a pair, from the extents of its clouds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud
from hybridreg.geometry import se3
from hybridreg.geometry.extent import reach, share_within

Array = NDArray[np.float64]

# Cells along the extent. On vehicle LiDAR (extent 25-50 m) this gives 0.4-0.8 m, in a room 5 cm.
_CELLS_ALONG_REACH = 60.0
# Extent of a thing, metres, at most: a LiDAR's points lie close together along its rings, which says nothing; by hand.
_THING = 1.0
# Voxel per distance of neighbouring points, at least. Of 150 objects with even seeds, four right poses were "failed"
# without it, two with 1.5 or 2.2.
_OF_APART = 2.0
# Cells along the extent, at least, however far points are apart: the other cloud may be in another unit; by hand.
_FEWEST_CELLS = 20.0
# Steps of a derived voxel in a power of ten, for a prepared target: a quarter larger each; by hand.
_STEPS = 10
# Cell of a map seen from above.
_MAP_CELL = 0.5  # metres outdoors; by hand
_CELLS_ALONG_MAP = 60.0  # in a room, cells along the radius of nearly all points; by hand
_NEARLY_ALL = 0.99  # share of the points; by hand
# Of the extents of two sensors' clouds of one place the longer is seldom ten times the shorter.
_MOST_RATIO = 25.0
# The tolerance is at most this share of the shorter extent: half a metre says nothing about a small object.
_OF_REACH = 0.04


def default_voxel(source: PointCloud, target: PointCloud) -> float:
    """Voxel for a pair, metres: the shorter of the two extents over 60, to two digits.

    A cloud's extent is the distance from its middle within which nine tenths of its points lie. Of a thing before a
    depth camera at least twice the distance of neighbouring points: nothing is seen between them.
    """
    shorter = min(reach(source.radii), reach(target.radii))
    # A cloud whose points lie nearly all in one place has no such extent; its bounding box is the next best.
    length = shorter or max(_longest(cloud) for cloud in (source, target))
    voxel = length / _CELLS_ALONG_REACH
    if length < _THING:
        voxel = max(voxel, min(_OF_APART * max(source.apart, target.apart), length / _FEWEST_CELLS))
    voxel = float(f"{voxel:.2g}")
    if voxel > 0.0 and (source.kept is not None or target.kept is not None):
        # So that scans of one sensor share what is kept.
        return float(f"{10.0 ** (round(_STEPS * np.log10(voxel)) / _STEPS):.2g}")
    return voxel


def map_cell(source: PointCloud, target: PointCloud) -> float:
    """Cell in which a pair is seen from above, metres: half a metre outdoors, less in rooms."""
    longer = max(share_within(cloud.radii, _NEARLY_ALL) for cloud in (source, target))
    return min(_MAP_CELL, float(f"{longer / _CELLS_ALONG_MAP:.2g}")) or _MAP_CELL


def size_ratio(source: PointCloud, target: PointCloud) -> float:
    """Extent of the target over that of the source; 1 where one has none."""
    a, b = reach(source.radii), reach(target.radii)
    return b / a if a > 0.0 and b > 0.0 else 1.0


def comparable(source: PointCloud, target: PointCloud) -> bool:
    """Whether two clouds may show one place in one unit: their extents differ by less than a factor of 25."""
    return 1.0 / _MOST_RATIO < size_ratio(source, target) < _MOST_RATIO


class Tolerance(NamedTuple):
    """How near to the true pose counts as right: `degrees` of rotation, and `metres` at the middle of the source."""

    degrees: float
    metres: float

    @classmethod
    def between(cls, T: Array, other: Array, centre: Array) -> Tolerance:
        """How far one pose (4, 4) lies from another, at a point `centre` (3,) of the target's frame."""
        step = other @ se3.inverse(T)
        moved = float(np.linalg.norm(se3.apply(step, centre[None])[0] - centre))
        return cls(se3.angle_deg(step[:3, :3]), moved)

    def within(self, allowed: Tolerance) -> bool:
        """Whether neither exceeds what is allowed."""
        return self.degrees <= allowed.degrees and self.metres <= allowed.metres


# The paper's own, for vehicle sensors (arXiv 2509.06456, section 4.1).
VEHICLES = Tolerance(2.0, 0.5)


def tolerance(source: PointCloud, target: PointCloud) -> Tolerance:
    """2 degrees and half a metre for vehicle sensors; less for smaller scenes, 4 % of the shorter extent."""
    shorter = min(reach(source.radii), reach(target.radii)) or _longest(source)
    return VEHICLES._replace(metres=min(VEHICLES.metres, float(f"{_OF_REACH * shorter:.2g}")))


def _longest(cloud: PointCloud) -> float:
    low, high = cloud.bounds
    return float((high - low).max())
