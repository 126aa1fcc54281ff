# SPDX-License-Identifier: MIT
"""How finely to look at two clouds when the user does not say."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Cells along the reach. On vehicle LiDAR (reach 25-50 m) this gives 0.4-0.8 m, in a room 5 cm.
_CELLS_ALONG_REACH = 60.0


def reach(points: Array) -> float:
    """Distance from the cloud's middle within which nine tenths of its points lie, metres."""
    return float(np.quantile(np.linalg.norm(points - np.median(points, axis=0), axis=1), 0.9))


def default_voxel(source: Array, target: Array) -> float:
    """Voxel for a pair, metres: the shorter of the two reaches over 60, to two digits."""
    shorter = min(reach(source), reach(target))
    # A cloud whose points lie nearly all in one place has no reach to speak of; its extent is the next best.
    length = shorter or float(max(np.ptp(source, axis=0).max(), np.ptp(target, axis=0).max()))
    return float(f"{length / _CELLS_ALONG_REACH:.2g}")
