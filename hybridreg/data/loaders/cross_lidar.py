# SPDX-License-Identifier: MIT
"""Any two sensors on one drive, each with its own poses: KITTI-CrossSource, HeLiPR, TIERS, your own."""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.lists import required_files
from hybridreg.data.lists.frame_pairs import pairs_across
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.lists.overlapping import overlapping
from hybridreg.data.lists.pair_files import PairFiles
from hybridreg.data.lists.trajectories import read_calibration, read_poses
from hybridreg.geometry import se3

Array = NDArray[np.float64]

_CLOUD_FOLDERS = ("velodyne", "scans", "clouds", "")
_POSE_FILES = ("poses.txt", "poses_kitti.txt")
CURE = "the poses' lines must be T_world_sensor, which map the sensor's points to the world"


@dataclass(frozen=True, kw_only=True)
class Rule:
    """Which frames of two sensors become pairs.

    Parameters
    ----------
    min_dist : float
        Metres between the two frames, at least; 0 pairs frames of the same number.
    min_overlap : float
        Least share of the source's points with a target point nearby; 0 requires none and reads no cloud.
    radius : float
        Metres within which a point counts as overlapping.
    """

    min_dist: float = 10.0
    min_overlap: float = 0.0
    radius: float = 0.5


class CrossLidar(ListedPairs):
    """Frames of one sensor against later frames of another: `T = inv(pose_target[j]) @ pose_source[i]`.

    Parameters
    ----------
    root : path
        Holds one folder a sensor: clouds named by their frame (`velodyne/000000.bin`, `scans/000000.pcd`, or
        straight in it) and `poses.txt` or `poses_kitti.txt`, line k for frame k: the upper three rows of
        T_world_sensor, one world for both. A reconstruction from images must be in metres.
    source, target : str
        The sensors' folders below `root`.
    min_dist, min_overlap, radius : float
        `Rule`. With `min_overlap` the list is made once and stored as JSON in `root`.
    source_calib, target_calib : str
        KITTI calibration below `root` whose `Tr` maps that sensor's points to the camera, where its poses are the
        camera's.

    Raises
    ------
    FileNotFoundError
        Saying what is missing and where it must be.
    ValueError
        Invalid poses, or no frames that fit the rule.
    """

    def __init__(
        self,
        root: str | os.PathLike[str],
        source: str = "source",
        target: str = "target",
        min_dist: float = 10.0,
        min_overlap: float = 0.0,
        radius: float = 0.5,
        source_calib: str = "",
        target_calib: str = "",
    ) -> None:
        base = required_files.folder(Path(root), "the folder of both sensors")
        rule = Rule(min_dist=min_dist, min_overlap=min_overlap, radius=radius)
        # A reconstruction may have clouds only for its keyframes.
        sources = Track.read(base, source, source_calib, whole=False)
        targets = Track.read(base, target, target_calib, whole=False)
        super().__init__(
            pairs_of(base, sources, targets, rule), base, if_inverted=CURE, overlap_radius=radius
        )


@dataclass(frozen=True, eq=False)
class Track:
    """One sensor's drive: clouds by frame, and T_world_sensor (N, 4, 4)."""

    sensor: str
    clouds: dict[int, Path]
    poses: Array

    @classmethod
    def read(cls, base: Path, sensor: str, calib: str = "", whole: bool = True) -> Track:
        """Find the clouds and poses of the folder `base/sensor`; `whole` refuses poses without a cloud.

        Raises
        ------
        FileNotFoundError
            No folder, clouds, poses or calibration; saying where they must be.
        ValueError
            Clouds without poses, or the reverse where `whole`.
        """
        folder = required_files.folder(base / sensor, f"the folder of the sensor {sensor}")
        clouds = next(folder / name for name in _CLOUD_FOLDERS if (folder / name).is_dir())
        file = required_files.first(
            [folder / name for name in _POSE_FILES], f"the poses of the sensor {sensor}"
        )
        poses = read_poses(file)
        if calib:
            poses = poses @ read_calibration(
                required_files.first([base / calib], f"the calibration of {sensor}")
            )
        frames = required_files.frames(clouds, f"clouds of the sensor {sensor}")
        if max(frames) >= len(poses):
            raise ValueError(
                f"{file}: {len(poses)} poses, but {clouds} has a frame {max(frames)}; "
                "write one line for each frame"
            )
        lacking = sorted(set(range(len(poses))) - set(frames))
        if whole and lacking:
            raise FileNotFoundError(
                f"{len(lacking)} of {len(poses)} clouds of the sensor {sensor} are missing; "
                f"the first must lie at {clouds}/{lacking[0]:06d}"
            )
        return cls(sensor, frames, poses)


def pairs_of(base: Path, source: Track, target: Track, rule: Rule, prefix: str = "") -> list[PairFiles]:
    """The pairs of two tracks that fit a rule; `prefix` begins their ids."""
    frames = pairs_across(
        source.poses[:, :3, 3],
        target.poses[:, :3, 3],
        list(source.clouds),
        list(target.clouds),
        rule.min_dist,
    )
    entries = [
        PairFiles(
            id=f"{prefix}{source.sensor}-{i}/{target.sensor}-{j}",
            source=source.clouds[i],
            target=target.clouds[j],
            T_target_source=se3.inverse(target.poses[j]) @ source.poses[i],
            source_sensor=source.sensor,
            target_sensor=target.sensor,
        )
        for i, j in frames
    ]
    if rule.min_overlap <= 0.0:
        return entries
    kept = overlapping(entries, base, rule.min_overlap, rule.radius)
    return [dataclasses.replace(entry, overlap=share) for entry, share in kept]
