# SPDX-License-Identifier: MIT
"""Iterative closest point, point to point (Besl and McKay 1992) and point to plane (Chen and Medioni 1992)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hybridreg.config import limits
from hybridreg.geometry import se3
from hybridreg.matches import Pose
from hybridreg.runtime.cores import n_threads
from hybridreg.scene import Scene
from hybridreg.stage import Stage

Array = NDArray[np.float64]

_FEWEST = 6
# Steps at which a round has converged.
_STILL_RAD = 1e-6  # radians, by hand
_STILL_M = 1e-5  # metres, by hand


@dataclass(frozen=True, kw_only=True)
class Icp(Stage):
    """Move the source onto its nearest target points until convergence.

    Parameters
    ----------
    kind : "point" or "plane"
        What is minimised: the distance to the nearest point, or to the plane through it.
    max_distances : tuple of float or None
        Maximum correspondence distance of each round, metres; None takes 5, 2.5 and 1.25 spacings of the levels.
    iterations : int
        At most, in each round.
    """

    kind: Literal["point", "plane"] = "point"
    max_distances: tuple[float, ...] | None = None
    iterations: int = 50

    def __post_init__(self) -> None:
        super().__post_init__()
        limits.positive(self, "max_distances")
        limits.at_least(self, 1, "iterations")

    def __call__(self, scene: Scene, pose: Pose) -> Pose:
        T = pose.T
        for distance in self.max_distances or (5 * scene.spacing, 2.5 * scene.spacing, 1.25 * scene.spacing):
            for _ in range(self.iterations):
                twist = self._step(scene, T, distance)
                if twist is None:
                    break
                T = se3.exp(twist) @ T
                if np.abs(twist[:3]).max() < _STILL_RAD and np.abs(twist[3:]).max() < _STILL_M:
                    break
        return replace(pose, T=T)

    def _step(self, scene: Scene, T: Array, max_distance: float) -> Array | None:
        moved = se3.apply(T, scene.source.points)
        distance, index = scene.target.tree.query(
            moved, distance_upper_bound=max_distance, workers=n_threads()
        )
        hit = np.isfinite(distance)
        if hit.sum() < _FEWEST:
            return None
        p, q = moved[hit], scene.target.points[index[hit]]
        if self.kind == "plane":
            return plane_step(p, q, scene.target.normals()[index[hit]])
        return point_step(p, q)


def plane_step(p: Array, q: Array, normals: Array) -> Array:
    """Gauss-Newton step (6,) on the distances of `p` (N, 3) to the planes at `q` with `normals`.

    Rotation vector in radians about the origin, then translation; unconstrained directions get no step.
    """
    J = np.hstack([np.cross(p, normals), normals])
    residual = np.sum((p - q) * normals, axis=1)
    # Least squares with a cut-off, so that an unconstrained direction gets no step at all.
    return np.linalg.lstsq(J.T @ J, -J.T @ residual, rcond=1e-9)[0]


def point_step(p: Array, q: Array) -> Array:
    """Rigid motion that maps `p` (N, 3) onto `q` in the least-squares sense, as a twist (6,)."""
    p_mean, q_mean = p.mean(axis=0), q.mean(axis=0)
    # Rotation that maximises trace(R H): the nearest rotation to the transposed cross-covariance.
    R = se3.project((q - q_mean).T @ (p - p_mean))
    return np.concatenate([se3.log_rotation(R), q_mean - R @ p_mean])
