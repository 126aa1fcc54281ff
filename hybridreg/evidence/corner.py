# SPDX-License-Identifier: MIT
"""Does nothing agree but the walls and the floor of one corner?

Two cameras that look into two corners of a room show the same three planes: a pose that lays one corner on the other
lets nearly all points agree, and the true one, by which the cameras look past one another, hardly any. Only what stands
or hangs in the corner tells which it is, or the length of a wall between two others.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.agreement import in_target
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.geometry import se3
from hybridreg.geometry.ground_relief import TELLS
from hybridreg.geometry.main_axes import faced
from hybridreg.pair import Pair

Array = NDArray[np.float64]

# Spacings from a wall's plane within which points lie on it; by hand.
_THICK = 1.5
# Points that make a wall, at least, and those of both walls that hold the pose; by hand.
_WALL, _HOLDS = 20, 60
# Points off the walls that agree below which nothing tells the corner: by hand. Of 13 poses that laid a corner of a
# made room on another none agreed, of right ones in furnished corners at least 380 did.
_FEW = 40
# Cosine of the angle between a level axis and the vertical, at most; by hand.
_LEVEL = 0.5


def bare_corner(at: PoseEvidence) -> bool:
    """Whether what agrees at the pose are planes that face three axes, walls on one side only of an axis that is level,
    and nothing off these planes."""
    if at.agreement.relief.information > TELLS:
        return False
    points, normals = _agreeing(at)
    if len(points) < _HOLDS:
        return False
    axes = at.agreement.axes
    axis, along = faced(normals, axes), points @ axes.T
    side = 2 * axis + (np.einsum("ni,ni->n", normals, axes[axis]) > 0.0)
    walls = np.zeros((3, 2), dtype=np.int64)
    for k in range(6):
        walls[k // 2, k % 2] = _on_plane(along[side == k, k // 2], _THICK * at.views.spacing)
    if len(points) - int(walls.sum()) > _FEW:
        return False
    level = np.abs(axes @ at.views.vertical(axes)) < _LEVEL
    one_sided = (walls > _WALL).sum(axis=1) == 1
    return bool((walls[level].sum(axis=1) > _HOLDS).all() and one_sided[level].any())


def others_allowed(pair: Pair, at: PoseEvidence) -> bool:
    """Whether the pair's bounds allow a pose about as far away as one in another corner: a quarter turn or a half."""
    vertical = at.views.vertical(at.agreement.axes)
    middle = se3.apply(at.T, at.views.middle)[0]
    turns = se3.rotation_about(0.5 * np.pi * np.arange(1, 4)[:, None] * vertical)
    return any(pair.allows(se3.about(middle, turn, np.zeros(3)) @ at.T) for turn in turns)


def _agreeing(at: PoseEvidence) -> tuple[Array, Array]:
    # Points (n, 3) of both clouds that agree, in the target's frame, and their normals towards the sensors.
    centres = (se3.apply(at.T, at.views.source.centre[None])[0], at.views.target.centre)
    parts = []
    for (_, way, points, normals), centre in zip(in_target(at.views, at.agreement), centres, strict=True):
        held = way.looked & way.agrees
        sight = np.einsum("ni,ni->n", centre - points[held], normals[held])
        parts.append((points[held], np.where(sight > 0.0, 1.0, -1.0)[:, None] * normals[held]))
    points, normals = (np.concatenate(part) for part in zip(*parts, strict=True))
    return points, normals


def _on_plane(along: Array, thick: float) -> int:
    # How many of some positions lie on the plane that holds most.
    rising = np.sort(along)
    return int(
        (np.searchsorted(rising, rising + 2.0 * thick, side="right") - np.arange(len(rising))).max(initial=0)
    )
