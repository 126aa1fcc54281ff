# SPDX-License-Identifier: MIT
"""KITTI's list of pairs: the usual frame spacing, odometry, and ICP composed on the right side."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.lists import required_files
from hybridreg.data.lists.frame_pairs import kitti_pairs
from hybridreg.data.lists.kitti_drives import SPLITS, Drive, base_of
from hybridreg.data.lists.pair_files import read_scan
from hybridreg.data.lists.trajectories import rigid
from hybridreg.geometry import se3
from hybridreg.io import write_json
from hybridreg.pair import Pair
from hybridreg.runtime.workers import spread

Array = NDArray[np.float64]

COMPOSITION = "T_icp @ M"
# The pair with a wrong published pose, left out by everyone since Predator.
_LEFT_OUT = {(8, 15, 58)}
# ICP as in the published lists.
_MAX_DISTANCE = 0.2  # metres
_ITERATIONS = 200
_VOXEL = 0.1  # metres, by hand


@dataclass(frozen=True, kw_only=True)
class ListedPose:
    """One pair of the list: sequence, frames, pose, and how far ICP moved it from the odometry."""

    drive: int
    source: int
    target: int
    T: list[list[float]]
    icp_deg: float
    icp_m: float
    composition: str = COMPOSITION


def place(base: Path, split: str) -> Path:
    """The file of a split's list."""
    return base / "metadata" / f"hybridreg-{split}.json"


def walk(base: Path, split: str) -> Iterator[tuple[int, int, int]]:
    """Sequence, source frame and target frame of every pair of a split."""
    for number in SPLITS[split]:
        for source, target in kitti_pairs(Drive(base, number).camera_poses[:, :3, 3]):
            if (number, source, target) not in _LEFT_OUT:
                yield number, source, target


def refined(drive: Drive, source: int, target: int) -> ListedPose:
    """The pose of two scans: point-to-point ICP within 0.2 m on a 0.1 m grid, started at the odometry M.

    ICP starts at M, so its correction is multiplied on the left: `T = T_icp @ M`. The published code's
    `M @ T_icp` applies the correction in the wrong frame (FCGF issue 65).
    """
    from hybridreg.classical.icp import Icp
    from hybridreg.classical.voxel import VoxelGrid
    from hybridreg.matches import Pose

    M = drive.motion(source, target)
    clouds = [read_scan(drive.scan(frame), f"{drive.number:02d}/{frame}") for frame in (source, target)]
    scene = VoxelGrid(voxel=_VOXEL)(Pair(source=clouds[0], target=clouds[1]))
    T = Icp(max_distances=(_MAX_DISTANCE,), iterations=_ITERATIONS)(scene, Pose(M)).T
    correction = T @ se3.inverse(M)
    return ListedPose(
        drive=drive.number,
        source=source,
        target=target,
        T=rigid(T, "ICP").tolist(),
        icp_deg=se3.angle_deg(correction[:3, :3]),
        icp_m=float(np.linalg.norm(T[:3, 3] - M[:3, 3])),
    )


def write(root: Path, split: str = "test", workers: int = 1) -> Path:
    """Make the list of a split and write it, whole or not at all; returns its path.

    Raises
    ------
    FileNotFoundError
        Scans, poses or a calibration are missing.
    ValueError
        An unknown split, or no pairs.
    """
    if split not in SPLITS:
        raise ValueError(f"split={split!r} must be one of {', '.join(SPLITS)}")
    base = base_of(root)
    jobs = [(Drive(base, n), source, target) for n, source, target in walk(base, split)]
    if not jobs:
        raise ValueError(f"{base}: no two scans of {split} lie 10 m apart")
    pairs = [asdict(each) for each in spread(refined, jobs, workers, ordered=True)]
    file = place(base, split)
    file.parent.mkdir(exist_ok=True)
    write_json(file, {"split": split, "composition": COMPOSITION, "pairs": pairs})
    return file


def read(base: Path, split: str) -> list[ListedPose]:
    """The list that `write` wrote.

    Raises
    ------
    FileNotFoundError
        There is none.
    ValueError
        Damaged.
    """
    file = required_files.first(
        [place(base, split)], "our list of KITTI's pairs (`hybridreg datasets kitti-list`)"
    )
    try:
        content: Any = json.loads(file.read_text(encoding="utf-8"))
        poses = [ListedPose(**each) for each in content["pairs"]]
    except (ValueError, TypeError, KeyError) as error:
        raise ValueError(f"{file}: is damaged ({error}); write it again") from error
    for n, each in enumerate(poses):
        rigid(each.T, f"{file}, pair {n}")
    return poses
