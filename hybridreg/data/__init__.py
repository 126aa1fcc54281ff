# SPDX-License-Identifier: MIT
"""Data sets: sequences of pairs with their true poses."""

from hybridreg.data.catalogue import names, open_dataset
from hybridreg.data.dataset import Dataset
from hybridreg.data.folder import PairFolder
from hybridreg.data.starts import YawStarts, yaw_starts

__all__ = ["Dataset", "PairFolder", "YawStarts", "names", "open_dataset", "yaw_starts"]
