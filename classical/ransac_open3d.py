# SPDX-License-Identifier: MIT
"""Open3D's RANSAC over matches, for comparison."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hybridreg.runtime.open3d import load_open3d

if TYPE_CHECKING:
    from hybridreg.classical.ransac import Ransac

Array = NDArray[np.float64]


def ransac_open3d(
    stage: Ransac, source: Array, target: Array, max_distance: float, rng: np.random.Generator
) -> Array | None:
    """Pose (4, 4) from matches (K, 3) to (K, 3), or None where fewer than 3 matches agree with the result.

    It is given only the matched points, as it copies and moves the whole source for each hypothesis.
    """
    o3d = load_open3d()
    registration = o3d.pipelines.registration
    rows = np.arange(len(source), dtype=np.int32)
    o3d.utility.random.seed(int(rng.integers(2**31)))
    result = registration.registration_ransac_based_on_correspondence(
        _cloud(o3d, source),
        _cloud(o3d, target),
        o3d.utility.Vector2iVector(np.column_stack([rows, rows])),
        max_distance,
        ransac_n=min(stage.sample_size, len(source)),
        checkers=[
            registration.CorrespondenceCheckerBasedOnEdgeLength(stage.edge_ratio),
            registration.CorrespondenceCheckerBasedOnDistance(max_distance),
        ],
        criteria=registration.RANSACConvergenceCriteria(stage.iterations, stage.confidence),
    )
    T = np.array(result.transformation, dtype=np.float64)
    agree = np.linalg.norm(source @ T[:3, :3].T + T[:3, 3] - target, axis=1) < max_distance
    return T if np.isfinite(T).all() and np.count_nonzero(agree) >= 3 else None


def _cloud(o3d: object, points: Array) -> object:
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points.copy()))  # type: ignore[attr-defined]
