# SPDX-License-Identifier: MIT
"""One sequence of KITTI odometry: its scans, its poses, and the motion between two scans."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.lists import required_files
from hybridreg.data.lists.trajectories import read_calibration, read_poses
from hybridreg.geometry import se3

Array = NDArray[np.float64]

SPLITS = {"train": range(0, 6), "val": range(6, 8), "test": range(8, 11)}


def base_of(root: Path) -> Path:
    """The folder that holds `sequences`: `root`, or `dataset` in it, as KITTI's archives unpack."""
    required_files.folder(root, "KITTI odometry")
    return root / "dataset" if (root / "dataset").is_dir() else root


@dataclass(frozen=True)
class Drive:
    """Sequence `number` below `base`."""

    base: Path
    number: int

    @property
    def folder(self) -> Path:
        """`sequences/NN`."""
        return self.base / "sequences" / f"{self.number:02d}"

    def scan(self, frame: int) -> Path:
        """The file of a scan."""
        return self.folder / "velodyne" / f"{frame:06d}.bin"

    @cached_property
    def camera_poses(self) -> Array:
        """T_world_camera (N, 4, 4) of every frame, as KITTI publishes them.

        Raises
        ------
        FileNotFoundError
            No poses, or no scans.
        ValueError
            More or fewer poses than scans, so that pairs would silently differ from the published ones.
        """
        name = f"{self.number:02d}.txt"
        file = required_files.first(
            [self.base / "poses" / name, self.folder / "poses.txt"],
            f"the poses of KITTI's sequence {name[:2]}",
        )
        poses = read_poses(file)
        scans = required_files.frames(self.folder / "velodyne", f"the scans of KITTI's sequence {name[:2]}")
        if set(scans) != set(range(len(poses))):
            raise ValueError(
                f"{file}: {len(poses)} poses, but {len(scans)} scans numbered {min(scans)} to {max(scans)} "
                f"in {self.folder / 'velodyne'}; unpack KITTI's velodyne archive again, it must be whole"
            )
        return poses

    def motion(self, source: int, target: int) -> Array:
        """T_target_source (4, 4) of two scans by odometry: camera poses carried over to the LiDAR."""
        T_camera_lidar = self._calibration
        cameras = se3.inverse(self.camera_poses[target]) @ self.camera_poses[source]
        return se3.inverse(T_camera_lidar) @ cameras @ T_camera_lidar

    @cached_property
    def _calibration(self) -> Array:
        what = f"the calibration of KITTI's sequence {self.number:02d}"
        return read_calibration(required_files.first([self.folder / "calib.txt"], what))
