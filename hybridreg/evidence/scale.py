# SPDX-License-Identifier: MIT
"""Does the source fit better at another scale? With a wrong unit or a stretched map no rigid pose is right."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.surface_distance import Surfaces, closeness, one_way
from hybridreg.evidence.views import Views
from hybridreg.geometry import se3
from hybridreg.geometry.point_to_plane import descend
from hybridreg.resolution import Tolerance

Array = NDArray[np.float64]

# Farthest partners of the rough steps, spacings; by hand.
_ROUGHLY = (8.0, 5.0, 4.0, 3.0, 2.0, 2.0)
# Farthest partners of the fine steps, shares of the fine surfaces' own; by hand.
_CLOSELY = (1.0, 0.6, 0.4)
# Points that take part; by hand.
_POINTS = 700
# Width of the weights per farthest partner; by hand.
_TRUST = 0.25
# Scales beyond this are no small error, and are not looked for here; by hand.
_MOST = 1.25
# Scales nearer to 1 than this are noise: of 38 right poses, real and simulated, four differ by more, and none of these
# lies closer at that scale.
_LEAST = 0.01
# What a sensor's ranges may be off by, metres. Nearby, that looks like another size: of a real pair that was cropped to
# 5, 8, 12 and 20 m, the source seemed 4.8, 2.9, 1.8 and 1.1 % too small. By hand.
_OFFSETS = (-0.2, -0.15, -0.1, -0.05, 0.05, 0.1, 0.15, 0.2)
# Nats per point that a size must gain for an offset to be tried instead: by hand.
_TOLD = 0.05


class Size(NamedTuple):
    """`scale` to multiply the source by, how many nats per point more closely it then lies on the target (0 where that
    is no gain, or the size is as good as 1), and how far `off` the pose is from there."""

    scale: float = 1.0
    gain: float = 0.0
    off: Tolerance = Tolerance(0.0, 0.0)


def size(views: Views, T_target_source: Array, close: float) -> Size:
    """Size at which the source fits best about a pose (4, 4) whose closeness is `close`."""
    fitted = _fitted(views, T_target_source)
    scale = float(np.cbrt(np.linalg.det(fitted[:3, :3])))
    if not _LEAST < abs(np.log(max(scale, 1e-9))) < np.log(_MOST):
        return Size()
    gain = closeness(views.fine, fitted) - close
    if gain <= 0.0 or (gain > _TOLD and _is_range_offset(views, T_target_source, fitted)):
        return Size()
    middle = views.middle
    turn = se3.project(fitted[:3, :3])
    there = se3.from_rt(turn, (se3.apply(fitted, middle) - middle @ turn.T)[0])
    return Size(scale, gain, Tolerance.between(T_target_source, there, se3.apply(T_target_source, middle)[0]))


def _is_range_offset(views: Views, T: Array, fitted: Array) -> bool:
    # Whether an offset of all the source's ranges explains as much: then the size is right.
    source, target = views.fine
    if views.source.image is None:
        return False
    rays = source.asked - views.source.centre
    ranges = np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), target.far)

    def gained(offset: float) -> float:
        moved = source.asked + offset * rays / ranges
        return one_way(moved, target, descend(T, moved[:_POINTS], target, _close_steps(target)))

    return max(map(gained, _OFFSETS)) >= one_way(source.asked, target, fitted)


def _fitted(views: Views, T: Array) -> Array:
    spacing = views.spacing
    points = views.source.points[views.source.settling[:_POINTS]]
    roughly = [_step(reach * spacing, spacing) for reach in _ROUGHLY]
    M = descend(T, points, views.target, roughly, sized=True)
    fine, surfaces = views.fine
    return descend(M, fine.asked[:_POINTS], surfaces, _close_steps(surfaces), sized=True)


def _close_steps(surfaces: Surfaces) -> list[tuple[float, float]]:
    return [_step(part * surfaces.far, surfaces.noise) for part in _CLOSELY]


def _step(reach: float, noise: float) -> tuple[float, float]:
    return reach, max(noise, _TRUST * reach)
