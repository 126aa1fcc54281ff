# SPDX-License-Identifier: MIT
"""Clouds at the spacing that a network was trained with."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.voxel_cells import voxel_centroids
from hybridreg.scene import Scene

_SAME = 0.01  # relative difference below which two spacings are equal; by hand
_ANOTHER_SCALE = 2.0  # factor beyond which the scene itself may be of another size; by hand


def on_grid(scene: Scene, voxel: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points of target and source, (M, 3) and (N, 3), with a spacing of ``voxel`` metres.

    Levels of that spacing are used directly; otherwise the clouds are voxelised on the network's own grid, with a
    note.
    """
    if note_grid(scene, voxel):
        return scene.target.points, scene.source.points
    pair = scene.pair
    return voxel_centroids(pair.target.points, voxel), voxel_centroids(pair.source.points, voxel)


def note_grid(scene: Scene, voxel: float) -> bool:
    """Whether both levels have the spacing that a network was trained with; leaves a note where they have not."""
    ready = all(math.isclose(s, voxel, rel_tol=_SAME) for s in (scene.source.spacing, scene.target.spacing))
    if not ready:
        scene.note(_mismatch(scene.spacing, voxel))
    return ready


def _mismatch(spacing: float, voxel: float) -> str:
    text = (
        f"the network was trained with a voxel of {voxel:.3g} m and put the clouds on a grid of its own; the other "
        f"stages work at {spacing:.3g} m"
    )
    if max(spacing / voxel, voxel / spacing) > _ANOTHER_SCALE:
        return f"{text}: is the scene of the size that the network was trained for?"
    return text
