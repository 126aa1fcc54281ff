# SPDX-License-Identifier: MIT
"""Terrain: the height of uneven ground over the plane under the sensor, as a coarse map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.extent import bounds

Array = NDArray[np.float64]

# Points this close to the plane may be ground; by hand.
_NEAR = 0.4  # metres
_SLOPE = 0.08  # and this much more for each metre of distance: a slope of a few degrees
# Weight of the plane where cells around have no ground.
_PLANE = 0.02
# The lowest point of a cell lies below its ground by about the noise.
_LIFT = 0.05


@dataclass(frozen=True, eq=False)
class Terrain:
    """Heights (nx, ny) at the centres of square cells, metres; `corner` (2,) is the map's lower corner."""

    heights: Array
    corner: Array
    cell: float

    @classmethod
    def of(cls, points: Array, cell: float) -> Terrain:
        """Smoothed lowest points of each cell of a levelled cloud (n, 3) whose ground plane is z = 0; flat without any.

        Parameters
        ----------
        cell : float
            Metres; wider than the gaps between returns on the ground, narrower than its waves.
        """
        from scipy.ndimage import gaussian_filter

        if len(points) == 0:
            return cls(np.zeros((1, 1)), np.zeros(2), cell)
        reach = np.hypot(points[:, 0], points[:, 1])
        low = points[np.abs(points[:, 2]) < _NEAR + _SLOPE * reach]
        corner, end = bounds(points[:, :2])
        shape = np.floor((end - corner) / cell).astype(np.int64) + 1
        i, j = ((low[:, :2] - corner) / cell).astype(np.int64).T
        lowest = np.full(shape, np.inf)
        np.minimum.at(lowest, (i, j), low[:, 2])
        known = np.isfinite(lowest)
        weight = gaussian_filter(known.astype(np.float64), 1.0)
        total = gaussian_filter(np.where(known, lowest, 0.0), 1.0)
        return cls(total / (weight + _PLANE) + _LIFT, corner, cell)

    def at(self, xy: Array) -> Array:
        """Height (n,) of the ground at places (n, 2), metres; beyond the map the height at its border."""
        i, j = np.clip(
            ((xy - self.corner) / self.cell).astype(np.int64), 0, np.array(self.heights.shape) - 1
        ).T
        height: Array = self.heights[i, j]
        return height
