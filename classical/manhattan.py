# SPDX-License-Identifier: MIT
"""Pose of two clouds whose surfaces face three orthogonal directions: a Manhattan world (Coughlan and Yuille 1999)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import views
from hybridreg.geometry.main_axes import main_axes
from hybridreg.matches import Correspondences, Pose
from hybridreg.scene import Scene
from hybridreg.search.axis_turns import TURNS, poses
from hybridreg.search.hypothesis import as_pose
from hybridreg.search.settle import best_first
from hybridreg.stage import Stage

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Manhattan(Stage):
    """Search the 24 rotations that map the main axes of one cloud onto those of the other.

    For rooms, buildings and things made of boxes, in any orientation: neither the ground nor the vertical need be
    known. The main axes are the three orthogonal directions that most surfaces face
    (`hybridreg.geometry.main_axes`). For each rotation the shift is taken at which most surfaces meet that face the
    same way; these poses are settled on the surfaces and ranked by their log-odds. The others are returned as
    `rivals`.
    """

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        both = views.of(scene)
        source, target = (_right_handed(main_axes(view.normals)) for view in (both.source, both.target))
        found = best_first(scene, list(poses(both, target, target.T @ TURNS @ source)))
        return as_pose(found) if found else Pose.unknown()


def _right_handed(axes: Array) -> Array:
    return axes * np.linalg.det(axes)
