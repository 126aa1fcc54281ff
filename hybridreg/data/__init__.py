# SPDX-License-Identifier: MIT
"""Data sets: sequences of pairs with their true poses."""

from hybridreg.data.catalogue import names, open_dataset
from hybridreg.data.cross3dreg import Cross3DReg
from hybridreg.data.cross_lidar import CrossLidar
from hybridreg.data.dataset import Dataset
from hybridreg.data.folder import PairFolder
from hybridreg.data.helipr import HeLiPr
from hybridreg.data.kitti import Kitti
from hybridreg.data.listed import ListedPairs
from hybridreg.data.pair_files import PairFiles
from hybridreg.data.starts import YawStarts, yaw_starts
from hybridreg.data.threedcsr import ThreeDCsr
from hybridreg.data.threedmatch import ThreeDMatch
from hybridreg.data.tiers import Tiers

__all__ = [
    "Cross3DReg",
    "CrossLidar",
    "Dataset",
    "HeLiPr",
    "Kitti",
    "ListedPairs",
    "PairFiles",
    "PairFolder",
    "ThreeDCsr",
    "ThreeDMatch",
    "Tiers",
    "YawStarts",
    "names",
    "open_dataset",
    "yaw_starts",
]
