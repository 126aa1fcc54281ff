# SPDX-License-Identifier: MIT
"""Does the source fit better at another size? A wrong unit, a bad calibration or a stretched map has no right pose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg import se3
from hybridreg.scene import Scene
from hybridreg.verdict import views
from hybridreg.verdict.closeness import closeness, fine_surfaces
from hybridreg.verdict.information import jacobian
from hybridreg.verdict.settle import Planes

Array = NDArray[np.float64]

# Search distances of the steps: spacings of the evidence, then shares of the fine surfaces' farthest partner; points.
_ROUGHLY, _CLOSELY, _POINTS = (8.0, 5.0, 4.0, 3.0, 2.0, 2.0), (1.0, 0.6, 0.4), 700
# Width of the weights per search distance; partners that a step takes, at least.
_TRUST, _FEWEST = 0.25, 30
# Sizes beyond this are no small error, and not looked for here; nearer to 1 than this they are noise: of 38 right
# poses, real and simulated, four differ by more, none of which lies more closely at that size.
_MOST, _LEAST = 1.25, 0.01


class Size(NamedTuple):
    """`scale` to multiply the source by, and how many nats per point more closely it then lies on the target; 0 where
    that is no gain, or the size is as good as 1."""

    scale: float = 1.0
    gain: float = 0.0


def size(scene: Scene, T_target_source: Array) -> Size:
    """Size at which the source fits best about a pose (4, 4)."""

    def look() -> Size:
        T = T_target_source
        fitted = _fitted(scene, T)
        scale = float(np.cbrt(np.linalg.det(fitted[:3, :3])))
        if not _LEAST < abs(np.log(max(scale, 1e-9))) < np.log(_MOST):
            return Size()
        gain = closeness(scene, fitted) - closeness(scene, T)
        return Size(scale, gain) if gain > 0.0 else Size()

    return scene.shared(("verdict", "size", T_target_source.tobytes()), look)


def _fitted(scene: Scene, T: Array) -> Array:
    source, target = views.views(scene)
    spacing = views.spacing(scene)
    M = T
    for reach in _ROUGHLY:
        M = _stepped(M, source.points[source.settling[:_POINTS]], target, reach * spacing, spacing)
    fine_source, fine_target = fine_surfaces(scene)
    for share in _CLOSELY:
        M = _stepped(M, fine_source.asked[:_POINTS], fine_target, share * fine_target.far, fine_target.noise)
    return M


def _stepped(M: Array, points: Array, surfaces: Planes, reach: float, noise: float) -> Array:
    # One step of point-to-plane ICP with a seventh unknown, the size about the middle of what is near.
    moved = se3.apply(M, points)
    distance, match = surfaces.tree.query(moved, distance_upper_bound=reach)
    hit = np.isfinite(distance)
    if np.count_nonzero(hit) < _FEWEST:
        return M
    row = np.asarray(match)[hit]
    at, normals = moved[hit], surfaces.facing(row)
    gap = np.einsum("ni,ni->n", at - surfaces.points[row], normals)
    weight = 1.0 / (1.0 + (gap / max(noise, _TRUST * reach)) ** 2)
    centre = at.mean(axis=0)
    arms = at - centre
    J = np.column_stack([jacobian(arms, normals), np.einsum("ni,ni->n", arms, normals)])
    H = (J * weight[:, None]).T @ J
    x = -np.linalg.solve(H + 1e-6 * np.trace(H) * np.eye(7), J.T @ (weight * gap))
    step = se3.about(centre, se3.rotation_about(x[:3]), x[3:6])
    grow = np.eye(4)
    grow[:3, :3] *= 1.0 + x[6]
    grow[:3, 3] = -x[6] * centre
    return step @ grow @ M
