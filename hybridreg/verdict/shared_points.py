# SPDX-License-Identifier: MIT
"""Do both clouds hold the same points, to the last bit, and does the pose lay them on themselves?

Two scans never measure the same numbers. A buffer that is not cleared leaves the end of one scan behind the next, and a
map may be drawn into both clouds; such points draw the pose to where they coincide, whatever the scans say.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.pair import Pair

Array = NDArray[np.float64]

# Points of the source that are looked up: for speed.
_ASKED = 3_000
# Share of them from which it is told, and up to which: a scan that lies whole in its map is no mistake; by hand.
_LEAST, _MOST = 0.03, 0.9
# Farthest from themselves that the pose lays most of them, tolerances; by hand.
_ON_THEMSELVES = 0.5


def shared_points(pair: Pair, T_target_source: Array, allowed: float) -> str:
    """What is wrong, in a sentence, where a pose (4, 4) lays the points that both clouds hold on themselves, to half of
    the `allowed` metres; empty where there are few."""
    source, target = pair.source, pair.target
    if not np.array_equal(source.offset, target.offset):
        return ""
    some = source.points[:: max(1, len(source.points) // _ASKED)]
    moved = np.linalg.norm(se3.apply(T_target_source, some) - some, axis=1)
    stays = moved <= _ON_THEMSELVES * allowed
    if np.count_nonzero(stays) < 0.5 * _LEAST * len(some):  # so of most poses, without the search below
        return ""
    rows = {row.tobytes() for row in target.points[np.isin(target.points[:, 0], some[:, 0])]}
    shared = np.array([row.tobytes() in rows for row in some])
    if not _LEAST <= shared.mean() <= _MOST or np.median(moved[shared]) > _ON_THEMSELVES * allowed:
        return ""
    return (
        f"{shared.mean():.0%} of the source's points are points of the target, to the last bit, and the pose lays them "
        "on themselves: does a buffer still hold another scan, or was something drawn into both? Leave those points out"
    )
