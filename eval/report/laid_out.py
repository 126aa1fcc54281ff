# SPDX-License-Identifier: MIT
"""Both clouds of a registration in the target's frame, with what a picture of the pose shows: residuals, free-space
violations, the sensors, the rivals."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.voxel import VoxelGrid
from hybridreg.evidence import agreement, views
from hybridreg.evidence.surface_distance import Surfaces
from hybridreg.frames import lower_pose
from hybridreg.geometry import se3
from hybridreg.geometry.extent import sample
from hybridreg.pair import Pair
from hybridreg.prior.placing import sized
from hybridreg.resolution import Tolerance
from hybridreg.result import RegistrationResult

Array = NDArray[np.float64]

# Points drawn of each cloud: a page of them stays below a megabyte.
DRAWN = 16_000
# Of the target, of source points without a surface of the target near by, and of the source as it came.
TARGET, ALONE, BEFORE = "#8f99a8", "#c9b458", "#a6761d"


@dataclass(frozen=True, eq=False, kw_only=True)
class LaidOut:
    """A pose as it is drawn; metres, the target's frame less its offset.

    Attributes
    ----------
    source, before, target : (n, 3), (n, 3), (m, 3)
        The source's points at the pose and as they came, and the target's.
    residual : (n,)
        Distance of each source point to the target's nearest surface; NaN where none is near.
    violations : (k, 3)
        Sampled points of either cloud at which the other sensor saw through.
    looked : int
        Sampled points that the other sensor looked at, of which the violations are a part.
    sensors : mapping of "source" and "target" to (j, 3)
        Where they stood; empty where that is not known.
    rivals : (r, 4, 4)
        Motions of the source's points in `source` onto where each rival puts them.
    """

    source: Array
    before: Array
    target: Array
    residual: Array
    violations: Array
    looked: int
    sensors: dict[str, Array] = field(default_factory=dict)
    rivals: Array = field(default_factory=lambda: np.empty((0, 4, 4)))


def of(pair: Pair, result: RegistrationResult) -> LaidOut:
    """Lay a pair out at the result's pose; what it costs is that of a verdict."""
    pair = pair.replaced(source=sized(pair.source, result.scale))
    T = lower_pose(result.transformation, pair)
    both = views.of(VoxelGrid()(pair))
    seen = agreement.compare(both, T)
    moving = sample(pair.source.points, DRAWN)
    source = se3.apply(T, moving)
    # Sampled points of the target that the source's sensor saw through are drawn where they are.
    through = both.target.points[both.target.asked][seen.target.free]
    back = se3.inverse(T)
    return LaidOut(
        source=source,
        before=moving,
        target=sample(pair.target.points, DRAWN),
        residual=residuals(source, both.fine.target),
        violations=np.vstack([seen.source.moved[seen.source.free], through]),
        looked=int(seen.source.looked.sum() + seen.target.looked.sum()),
        sensors={
            "source": se3.apply(T, pair.source.seen.places),
            "target": np.asarray(pair.target.seen.places),
        },
        rivals=np.array([lower_pose(rival, pair) @ back for rival in result.rivals]).reshape(-1, 4, 4),
    )


def reddest(allowed: Tolerance) -> float:
    """Metres at which the colours of residuals end: half of those within which a pose is right."""
    return 0.5 * allowed.metres


def residuals(points: Array, surfaces: Surfaces) -> Array:
    """Distance (n,) of points (n, 3) to the plane of the nearest surface point, where one is near; else NaN."""
    distance, row = surfaces.tree.query(points, distance_upper_bound=surfaces.far)
    found = np.isfinite(distance)
    result = np.full(len(points), np.nan)
    off = points[found] - surfaces.points[row[found]]
    result[found] = np.abs(np.einsum("ni,ni->n", off, surfaces.facing(row[found])))
    return result
