# SPDX-License-Identifier: MIT
"""3DCSR: 202 indoor pairs of a Kinect with a LiDAR or with structure from motion (Huang et al. 2021)."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from hybridreg.data.lists import required_files
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.lists.pair_files import PairFiles
from hybridreg.data.lists.trajectories import read_matrix
from hybridreg.geometry import se3

# Pattern of the pairs' folders, and the sensor that Kinect's cloud is registered to.
_FOLDERS = {"kinect_lidar/*/*": "lidar", "kinect_sfm/*/*": "sfm"}


class ThreeDCsr(ListedPairs):
    """Kinect (source) against LiDAR or SfM (target), no images; the usual thresholds are 15 deg and 0.3 m.

    Parameters
    ----------
    root : path
        Holds `kinect_lidar/<scene>/<pair>/{kinect.ply,lidar.ply,T_gt.txt}` and
        `kinect_sfm/{easy,hard}/<scene>/{kinect.ply,sfm.ply,T_gt.txt}`; one of the two is enough.
    part : str
        "kinect_lidar", "kinect_sfm", "kinect_sfm/easy", "kinect_sfm/hard"; all if empty.

    Raises
    ------
    FileNotFoundError
        Saying what is missing and where it must be.
    """

    def __init__(self, root: str | os.PathLike[str], part: str = "") -> None:
        base = required_files.folder(Path(root), "3DCSR")
        entries = [entry for entry in _entries(base) if f"{entry.id}/".startswith(part)]
        if not entries:
            within = f" below {part}/" if part else ""
            raise FileNotFoundError(
                f"pairs of 3DCSR{within} are missing; they must lie at {base}/kinect_lidar/<scene>/<pair>/ "
                f"and {base}/kinect_sfm/<easy or hard>/<scene>/"
            )
        super().__init__(entries, base, overlap_radius=0.1)


def _entries(base: Path) -> Iterator[PairFiles]:
    for pattern, sensor in _FOLDERS.items():
        for folder in sorted(f for f in base.glob(pattern) if f.is_dir()):
            truth = required_files.first([folder / "T_gt.txt"], f"the pose of {folder.name}")
            yield PairFiles(
                id=folder.relative_to(base).as_posix(),
                source=folder / "kinect.ply",
                target=folder / f"{sensor}.ply",
                # T_gt maps the other sensor to Kinect.
                T_target_source=se3.inverse(read_matrix(truth)),
                source_sensor="kinect",
                target_sensor=sensor,
            )
