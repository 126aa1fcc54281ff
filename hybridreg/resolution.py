# SPDX-License-Identifier: MIT
"""How finely to look at two clouds when the user does not say."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud
from hybridreg.extent import share_within

Array = NDArray[np.float64]

# Cells along the reach. On vehicle LiDAR (reach 25-50 m) this gives 0.4-0.8 m, in a room 5 cm.
_CELLS_ALONG_REACH = 60.0
# Of the points, whose distance from the cloud's middle is its reach: stray returns lie anywhere.
_MOST = 0.9


def default_voxel(source: PointCloud, target: PointCloud) -> float:
    """Voxel for a pair, metres: the shorter of the two reaches over 60, to two digits.

    A cloud's reach is the distance from its middle within which nine tenths of its points lie.
    """
    shorter = min(reach(source.radii), reach(target.radii))
    # A cloud whose points lie nearly all in one place has no reach to speak of; its extent is the next best.
    length = shorter or max(_longest(cloud) for cloud in (source, target))
    return float(f"{length / _CELLS_ALONG_REACH:.2g}")


def _longest(cloud: PointCloud) -> float:
    low, high = cloud.bounds
    return float((high - low).max())


def reach(radii: Array) -> float:
    """Reach of a cloud, metres, from its `radii`."""
    return share_within(radii, _MOST)
