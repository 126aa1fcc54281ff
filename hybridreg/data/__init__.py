# SPDX-License-Identifier: MIT
"""Data sets: sequences of pairs with their true poses."""

from hybridreg.data.catalogue import names, open_dataset
from hybridreg.data.dataset import Dataset
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.lists.pair_files import PairFiles
from hybridreg.data.loaders.cross3dreg import Cross3DReg
from hybridreg.data.loaders.cross_lidar import CrossLidar
from hybridreg.data.loaders.dair_v2x import DairV2x
from hybridreg.data.loaders.folder import PairFolder
from hybridreg.data.loaders.helipr import HeLiPr
from hybridreg.data.loaders.kitti import Kitti
from hybridreg.data.loaders.pandaset import PandaSet
from hybridreg.data.loaders.threedcsr import ThreeDCsr
from hybridreg.data.loaders.threedmatch import ThreeDMatch
from hybridreg.data.loaders.tiers import Tiers
from hybridreg.data.yaw_starts import YawStarts, yaw_starts

__all__ = [
    "Cross3DReg",
    "CrossLidar",
    "DairV2x",
    "Dataset",
    "HeLiPr",
    "Kitti",
    "ListedPairs",
    "PairFiles",
    "PairFolder",
    "PandaSet",
    "ThreeDCsr",
    "ThreeDMatch",
    "Tiers",
    "YawStarts",
    "names",
    "open_dataset",
    "yaw_starts",
]
