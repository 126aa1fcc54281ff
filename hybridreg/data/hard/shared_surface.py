# SPDX-License-Identifier: MIT
"""How much surface two clouds share at a pose, in which directions it faces, and whether that suffices to find the
pose."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.data.hard.sights import Shot, thin
from hybridreg.data.hard.true_poses import Sample
from hybridreg.geometry import se3

Array = NDArray[np.float64]


class Bar(NamedTuple):
    """What two clouds must share for a good method to find their pose; set by hand on some 20 pairs of each kind."""

    # Common share of the cloud that shares more.
    share: float = 0.25
    # Common voxels that face along the weakest axis: number, and share of all common ones.
    facing: float = 20.0
    weakest: float = 0.02
    # How much lower the common share must be at a repetition.
    drop: float = 0.05
    # 2 for clouds in a plane.
    axes: int = 3


class Common(NamedTuple):
    """Share of the source's surface voxels that the target has too, and the normals there (n, 3)."""

    share: float
    normals: Array


def common(source: Shot, target: Shot, grain: float, moved: Array | None = None) -> Common:
    """Common surface at the true pose, or where the source is `moved` (4, 4) in the world.

    A voxel of `grain` metres is common where the target's nearest point lies within three grains on the same plane.
    """
    T_world = source.T_world if moved is None else moved @ source.T_world
    here = thin(Shot(source.points, source.normals, T_world).within(target.T_world), grain)
    distance, i = cKDTree(target.points).query(here.points, distance_upper_bound=3.0 * grain)
    near = np.isfinite(distance)
    i, normals = i[near], here.normals[near]
    off = np.abs(np.einsum("ij,ij->i", here.points[near] - target.points[i], target.normals[i]))
    alike = np.abs(np.einsum("ij,ij->i", normals, target.normals[i])) > 0.8
    same = (off < 0.5 * grain) & alike
    return Common(float(same.sum()) / max(len(here.points), 1), normals[same])


def enough(
    source: Shot, target: Shot, grain: float, rivals: Iterable[Array] = (), bar: Bar | None = None
) -> bool:
    """Whether a good method should find the pose.

    `rivals` are motions (4, 4) in the world under which the place may look the same: repetitions and turns.
    """
    bar = bar or Bar()
    if min(len(source.points), len(target.points)) < 100:
        return False
    found = common(source, target, grain)
    back = common(target, source, grain).share
    if max(found.share, back) < bar.share or len(found.normals) < bar.facing:
        return False
    facing = np.linalg.eigvalsh(found.normals.T @ found.normals)[-bar.axes]
    if facing < max(bar.facing, bar.weakest * len(found.normals)):
        return False
    return all(found.share - common(source, target, grain, moved).share > bar.drop for moved in rivals)


def turn_about(x: float, y: float, degrees: float) -> Array:
    """Motion (4, 4) that turns about an upright axis through x, y."""
    return se3.about(np.array([x, y, 0.0]), se3.yaw(degrees)[:3, :3])


def flip_about(x: float, y: float, z: float, axis: int) -> Array:
    """Motion (4, 4) that turns upside down about a level axis through x, y, z: 0 for x, 1 for y."""
    return se3.about(np.array([x, y, z]), se3.rotation_about(np.pi * np.eye(3)[axis]))


def shift(x: float, y: float) -> Array:
    """Motion (4, 4) in the plane."""
    return se3.from_rt(np.eye(3), np.array([x, y, 0.0]))


def judged(
    source: Shot,
    target: Shot,
    metres: float,
    grain: float,
    rivals: Iterable[Array] = (),
    bar: Bar | None = None,
) -> Sample:
    """A sample from two shots, whose frames' poses give the true pose."""
    return Sample(
        kind="",
        name="",
        source=source.points,
        target=target.points,
        truths=(se3.inverse(target.T_world) @ source.T_world,),
        metres=metres,
        solvable=enough(source, target, grain, rivals, bar),
    )
