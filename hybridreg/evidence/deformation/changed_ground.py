# SPDX-License-Identifier: MIT
"""Does what stands on the ground fit better higher or lower than the ground lays it?

Snow, earthworks and tides raise or lower the ground between two scans, and leave the buildings. Most points lie on the
ground, so that a pose follows it, while the walls, which may slide along themselves, hardly object.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformation.deformed import Onto
from hybridreg.evidence.views import View, Views
from hybridreg.geometry import se3
from hybridreg.resolution import tolerance

Array = NDArray[np.float64]

# Standing points are farther from the plane of the ground than so many of its thicknesses; by hand.
_STANDING = 1.5
# Metres, heights that are tried up and down; and spacings between them, and of noise. By hand.
_HIGHEST, _STEP, _NOISE = 1.6, 0.25, 0.2
# Cosine from which a surface is level; by hand.
_LEVEL = 0.7
# Points of a cloud that are laid; for speed.
_MOST = 500
# Tolerances by which the ground must have changed, points that must come to lie on level surfaces then, times as many
# as do under the pose, and metres by which both clouds may differ in that height; by hand.
_HARM, _LIE, _TIMES, _ALIKE = 0.8, 2.5, 1.3, 0.3


class ChangedGround(NamedTuple):
    """By how many `metres` the target's ground lies higher than the source's, by what stands on both."""

    metres: float


def changed_ground(views: Views, T_target_source: Array) -> ChangedGround | None:
    """That under a pose (4, 4) that lays one ground on the other; None where it hardly matters."""
    if views.source.ground is None or views.target.ground is None:
        return None
    least = _HARM * tolerance(views.scene.pair.source, views.scene.pair.target).metres
    rises = []
    for _, onto, T in Onto.both_ways(views, T_target_source):
        rise = _rise(onto, T)
        if abs(rise) < least:
            return None
        rises.append(rise)
    forth, back = rises
    return ChangedGround(0.5 * (back - forth)) if abs(forth + back) < _ALIKE else None


def _rise(onto: Onto, T: Array) -> float:
    # Metres along the other cloud's vertical by which the level surfaces that stand in the moved cloud fit better; 0
    # where they do not.
    thick = _STANDING * max(onto.spacing, onto.moved.thickness, onto.other.thickness)
    points = onto.moved.points[_level(onto.moved, thick)]
    moved = se3.apply(T, points[:: max(1, len(points) // _MOST)])
    level, up, step = _level(onto.other, thick), onto.other.upward, _STEP * onto.spacing
    heights = np.arange(-_HIGHEST, _HIGHEST + 0.5 * step, step)
    lie = np.array([_lie(moved + height * up, onto, level) for height in heights])
    best, before = int(np.argmax(lie)), lie[np.abs(heights) < 1.5 * step].max()
    inside = 1 < best < len(heights) - 2  # not better beyond
    return float(heights[best]) if inside and lie[best] > max(_LIE, _TIMES * before) else 0.0


def _level(view: View, thick: float) -> NDArray[np.bool_]:
    # Which points face up or down and stand on the ground; walls slide along themselves and say nothing of heights.
    if view.ground is None:
        return np.zeros(len(view.points), dtype=bool)
    above, facing = view.ground.above(view.points), view.normals @ view.ground.up
    return (np.abs(above) > thick) & (np.abs(facing) > _LEVEL)


def _lie(moved: Array, onto: Onto, level: NDArray[np.bool_]) -> float:
    # How many of some points (n, 3) lie on level surfaces that stand in the other cloud.
    other, noise = onto.other, _NOISE * onto.spacing
    distance, match = other.tree.query(moved, distance_upper_bound=onto.spacing)
    near = np.isfinite(distance)
    near[near] = level[match[near]]
    row = match[near]
    across = np.einsum("ni,ni->n", moved[near] - other.points[row], other.normals[row])
    return float(np.exp(-0.5 * (across / noise) ** 2).sum())
