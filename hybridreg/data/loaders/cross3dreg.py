# SPDX-License-Identifier: MIT
"""Cross3DReg: a spinning and a semi-solid-state LiDAR with camera images, 13 231 pairs (arXiv 2509.06456)."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

from hybridreg.data.lists import azimuth, pair_records, required_files
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.lists.sequence_archive import SequenceArchive


class Cross3DReg(ListedPairs):
    """The paper's own data set; its limits are 2 deg and 0.5 m.

    Nothing but the archive's folders is known for certain: fields go by aliases (`hybridreg.data.lists.pair_records`),
    the sensors' roles by geometry, and the first pair asked for has the direction of 20 poses checked. Poses may
    be 4x4, 3x4 or lines of numbers, lists, arrays or tensors; clouds may be told by path, by file name, or by frame.

    Parameters
    ----------
    root : path
        Holds `metadata/<split>.pkl` and `sequences/NN/{lidar,array,image}/NNNNNN.{ply,jpg}`, or is above it.
    split : str
        "train", "val" or "test".
    inverted : bool
        The list's poses map target to source.
    swap : bool
        The list's cloud 0 is to be the source, and its cloud 1 the target.

    Raises
    ------
    FileNotFoundError
        Saying what is missing and where it must lie.
    ValueError
        The list is empty, damaged, or refers to classes that a list of pairs does not need.
    """

    def __init__(
        self,
        root: str | os.PathLike[str],
        split: str = "test",
        inverted: bool = False,
        swap: bool = False,
    ) -> None:
        base = required_files.folder(Path(root), "Cross3DReg")
        base = base / "Cross3DReg" if (base / "Cross3DReg").is_dir() else base
        table = required_files.first(
            [base / "metadata" / f"{split}.pkl"], f"Cross3DReg's list of the pairs of {split}"
        )
        rows = pair_records.read_records(table)
        archive = SequenceArchive(base, inverted=inverted, swap=swap)
        entries = [archive.entry(row, f"{table}, pair {n}") for n, row in enumerate(rows)]
        undo = "no" if inverted else "yes"
        cure = f"open the data set with inverted={undo}"
        super().__init__(entries, table, if_inverted=cure, fields=tuple(map(str, rows[0])))

    def check(self) -> None:
        super().check()
        pair = self.read(0).pair
        source, target = (azimuth.coverage(cloud.points).role for cloud in (pair.source, pair.target))
        if (source, target) == ("spinning", "limited"):
            warnings.warn(
                f"{self.origin}: the list's source spins and its target is a fan, the paper's are the "
                "other way round; the pairs are used as listed, unless the data set is opened with swap=yes",
                UserWarning,
                stacklevel=2,
            )
