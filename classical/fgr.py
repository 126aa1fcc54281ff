# SPDX-License-Identifier: MIT
"""Fast global registration (Zhou et al. 2016) from matches, by Open3D."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Pose
from hybridreg.runtime.open3d import load_open3d
from hybridreg.scene import Scene
from hybridreg.stage import Stage

Array = NDArray[np.float64]

# Open3D silently returns the identity where fewer matches pass its tuple test.
_FEWEST = 10


@dataclass(frozen=True, kw_only=True)
class Fgr(Stage):
    """Robust fit to all matches at once: a Geman-McClure cost whose width shrinks step by step.

    Parameters
    ----------
    max_distance : float or None
        Metres; residuals beyond it count for little at the end. None takes the spacing of the matches, or of the scene
        where they have none. (Open3D's own default, 0.025 of the cloud's diameter, is metres on a LiDAR scan.)
    division_factor : float
        The width shrinks by this factor every fourth iteration.
    iterations : int
    tuple_scale : float in (0, 1)
        Three matches are kept where the lengths of their edges agree up to this factor.
    max_tuples : int
        At most this many such triples are drawn.
    """

    max_distance: float | None = None
    division_factor: float = 1.4
    iterations: int = 64
    tuple_scale: float = 0.95
    max_tuples: int = 1_000

    needs: ClassVar[frozenset[str]] = frozenset({"matches"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.max_distance is not None and not self.max_distance > 0.0:
            raise ValueError(f"max_distance={self.max_distance} must be a positive length in metres")
        if not self.division_factor > 1.0:
            raise ValueError(f"division_factor={self.division_factor} must be larger than 1")
        if not 0.0 < self.tuple_scale < 1.0:
            raise ValueError(f"tuple_scale={self.tuple_scale} must lie in (0, 1)")
        for name in ("iterations", "max_tuples"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name}={getattr(self, name)} must be at least 1")

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        finite = np.isfinite(matches.source).all(axis=1) & np.isfinite(matches.target).all(axis=1)
        rows = np.flatnonzero(finite & (matches.weight > 0.0))
        if len(rows) < _FEWEST:
            scene.note(f"FGR needs at least {_FEWEST} matches, it got {len(rows)}")
            return Pose.unknown(len(matches))
        max_distance = self.max_distance or matches.spacing or scene.spacing
        T = self._solve(matches.source[rows], matches.target[rows], max_distance, int(rng.integers(2**31)))
        if T is None:
            scene.note("FGR found no pose: too few matches agree with one another")
            return Pose.unknown(len(matches))
        residual = np.linalg.norm(se3.apply(T, matches.source) - matches.target, axis=1)
        return Pose(T, inliers=residual < 1.5 * max_distance)

    def _solve(self, source: Array, target: Array, max_distance: float, seed: int) -> Array | None:
        o3d = load_open3d()
        o3d.utility.random.seed(seed)
        rows = np.arange(len(source), dtype=np.int32)
        result = o3d.pipelines.registration.registration_fgr_based_on_correspondence(
            o3d.geometry.PointCloud(o3d.utility.Vector3dVector(source.copy())),
            o3d.geometry.PointCloud(o3d.utility.Vector3dVector(target.copy())),
            o3d.utility.Vector2iVector(np.column_stack([rows, rows])),
            o3d.pipelines.registration.FastGlobalRegistrationOption(
                division_factor=self.division_factor,
                use_absolute_scale=True,
                decrease_mu=True,
                maximum_correspondence_distance=max_distance,
                iteration_number=self.iterations,
                tuple_scale=self.tuple_scale,
                maximum_tuple_count=self.max_tuples,
            ),
        )
        T = np.array(result.transformation, dtype=np.float64)
        agree = np.linalg.norm(se3.apply(T, source) - target, axis=1) < 1.5 * max_distance
        return T if np.isfinite(T).all() and np.count_nonzero(agree) >= 3 else None
