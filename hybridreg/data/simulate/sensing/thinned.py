# SPDX-License-Identifier: MIT
"""Clouds as they are trained on and stored: one point per voxel, quantised no finer than the voxel needs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.simulate.sensing.overlaps import thin


def thinned(points: NDArray[np.float32], voxel: float | None) -> NDArray[np.float32]:
    """`points` (n,3) as they are where `voxel` is None, otherwise one of each voxel of that edge, rounded to `step`."""
    if voxel is None:
        return points
    size = np.float32(step(voxel))
    return np.rint(thin(points, voxel) / size) * size


def step(voxel: float) -> float:
    """A sixteenth of `voxel` metres or less, a power of two: 1/64 m for 0.25 m.

    Half of it, 8 mm, is less than the sensors' own noise, and numbers that end in zero bits compress.
    """
    return float(2.0 ** np.floor(np.log2(voxel / 16)))
