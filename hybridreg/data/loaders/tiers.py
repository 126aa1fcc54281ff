# SPDX-License-Identifier: MIT
"""TIERS (Li et al. 2022) in the layout of BUFFER-X: several LiDARs on one robot, indoors."""

from __future__ import annotations

import os
from pathlib import Path

from hybridreg.data.lists import required_files
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.loaders.cross_lidar import CURE, Rule, Track, pairs_of

_LEFT_OUT = "09"  # its poses are not trusted


class Tiers(ListedPairs):
    """Frames of one LiDAR against frames of another, more than 2 m on, that share 30% at 0.1 m.

    Overlaps are measured the first time, which reads every cloud of the list, and stored as JSON in `root`.

    Parameters
    ----------
    root : path
        Holds `tiers_indoorNN/<sensor>/scans/NNNNNN.pcd` and `tiers_indoorNN/<sensor>/poses_kitti.txt`;
        sequence 09 is left out.
    source, target : str
        "vel16", "os1_64", "os0_128", "avia".
    min_dist, min_overlap, radius : float
        As in `CrossLidar`.

    Raises
    ------
    FileNotFoundError
        Saying what is missing and where it must be.
    """

    def __init__(
        self,
        root: str | os.PathLike[str],
        source: str = "vel16",
        target: str = "os0_128",
        min_dist: float = 2.0,
        min_overlap: float = 0.3,
        radius: float = 0.1,
    ) -> None:
        base = required_files.folder(Path(root), "TIERS")
        rule = Rule(min_dist=min_dist, min_overlap=min_overlap, radius=radius)
        drives = [f for f in sorted(base.glob("tiers_*")) if f.is_dir() and not f.name.endswith(_LEFT_OUT)]
        if not drives:
            raise FileNotFoundError(
                f"sequences of TIERS are missing; they must be the folders {base}/tiers_indoorNN"
            )
        entries = [
            entry
            for drive in drives
            for entry in pairs_of(
                base, Track.read(drive, source), Track.read(drive, target), rule, prefix=f"{drive.name}/"
            )
        ]
        super().__init__(entries, base, if_inverted=CURE, overlap_radius=radius)
