# SPDX-License-Identifier: MIT
"""The far plane of rendered depth images, which is what renderers give for a pixel in which they met nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.meaning.first_column import looked_at

Array = NDArray[np.float64]

_FEWEST, _LEAST = 20, 0.01  # points in the plane, and their share
_SAME = 1e-5  # of its distance, by which two that are the same may differ: single precision, digits of a text
_NEARER = 0.5  # of its distance; what was seen lies nearer
# Times the distance ahead; no pinhole camera sees what is more aside, as a LiDAR above a floor does.
_ASIDE = 2.5


def far_plane(points: Array) -> str | None:
    """What is wrong, in words, with finite points (N, 3) of which many lie exactly in the farthest plane across an axis
    along which a camera at the origin looks; None where there is no such plane.

    A wall without noise behind things that stand out by more than half its distance looks alike.
    """
    if len(points) < _FEWEST or _plane(points[looked_at(len(points))]) is None:
        return None
    found = _plane(points)
    if found is None:
        return None
    axis, far, count = found
    return (
        f"{count} of {len(points)} points lie exactly in the plane {axis} = {far:.6g}, all others less than half as "
        "far, as the pixels of a rendered depth image do that met nothing; remove them if so"
    )


def _plane(points: Array) -> tuple[str, float, int] | None:
    low, high = points.min(axis=0), points.max(axis=0)
    for k in range(3):
        # A camera sees what is ahead; missing returns, (0, 0, 0), were told before.
        if low[k] <= 0.0 <= high[k]:
            continue
        far = float(high[k] if high[k] > 0.0 else low[k])
        depth = points[:, k] / far
        there = depth >= 1.0 - _SAME
        if (np.abs(np.delete(points, k, axis=1)).max(axis=1) / _ASIDE > np.abs(points[:, k])).any():
            continue
        count = int(np.count_nonzero(there))
        if max(_FEWEST, _LEAST * len(points)) <= count < len(points) and depth[~there].max() < _NEARER:
            return "xyz"[k], far, count
    return None
