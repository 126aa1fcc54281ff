# SPDX-License-Identifier: MIT
"""HeLiPR (Jung et al. 2023) in the layout of BUFFER-X: spinning and solid-state LiDARs on one vehicle."""

from __future__ import annotations

import os
from pathlib import Path

from hybridreg.data.lists import required_files
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.loaders.cross_lidar import CURE, Rule, Track, pairs_of


class HeLiPr(ListedPairs):
    """Frames of one LiDAR against frames of another, more than 10 m on.

    Avia against Ouster is the closest public equivalent of Cross3DReg, without images.

    Parameters
    ----------
    root : path
        Holds `<sensor>/velodyne/NNNNNN.bin` (float32 x, y, z, intensity) and `<sensor>/poses.txt`.
    source, target : str
        "Avia" and "Aeva" are fans, "Ouster" and "Velodyne" spin.
    min_dist, min_overlap : float
        As in `CrossLidar`.

    Raises
    ------
    FileNotFoundError
        Saying what is missing and where it must be.
    """

    def __init__(
        self,
        root: str | os.PathLike[str],
        source: str = "Avia",
        target: str = "Ouster",
        min_dist: float = 10.0,
        min_overlap: float = 0.0,
    ) -> None:
        base = required_files.folder(Path(root), "HeLiPR")
        rule = Rule(min_dist=min_dist, min_overlap=min_overlap)
        entries = pairs_of(base, Track.read(base, source), Track.read(base, target), rule)
        super().__init__(entries, base, if_inverted=CURE, overlap_radius=rule.radius)
