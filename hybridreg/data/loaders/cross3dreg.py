# SPDX-License-Identifier: MIT
"""Cross3DReg: a spinning and a semi-solid-state LiDAR with camera images, 13 231 pairs (arXiv 2509.06456)."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from hybridreg.data.lists import azimuth, pair_records, required_files
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.lists.pair_files import PairFiles, read_scan
from hybridreg.geometry import se3
from hybridreg.io.faults import fault

_SENSORS = ("lidar", "array")  # the archive does not say which of the two is spinning


class Cross3DReg(ListedPairs):
    """The paper's own data set; its limits are 2 deg and 0.5 m.

    Only the archive's folders are known for certain: fields are found by aliases
    (`hybridreg.data.lists.pair_records`), the sensors' roles by geometry, and the first access checks the direction of
    20 poses.

    Parameters
    ----------
    root : path
        Holds `metadata/<split>.pkl` and `sequences/NN/{lidar,array,image}/NNNNNN.{ply,jpg}`, or is above it.
    split : str
        "train", "val" or "test".
    inverted : bool
        The list's poses map target to source.

    Raises
    ------
    FileNotFoundError
        Saying what is missing and where it must lie.
    ValueError
        The list is empty, damaged, or refers to classes that a list of pairs does not need.
    """

    def __init__(self, root: str | os.PathLike[str], split: str = "test", inverted: bool = False) -> None:
        base = required_files.folder(Path(root), "Cross3DReg")
        base = base / "Cross3DReg" if (base / "Cross3DReg").is_dir() else base
        table = required_files.first(
            [base / "metadata" / f"{split}.pkl"], f"Cross3DReg's list of the pairs of {split}"
        )
        rows = pair_records.read_records(table)
        archive = _Archive(base)
        entries = [archive.entry(row, f"{table}, pair {n}", inverted) for n, row in enumerate(rows)]
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
                "other way round; the pairs are used as listed",
                UserWarning,
                stacklevel=2,
            )


@dataclass
class _Archive:
    base: Path
    shelf: required_files.Shelf = field(default_factory=required_files.Shelf)
    _fan: str = ""

    def entry(self, row: pair_records.Record, label: str, inverted: bool) -> PairFiles:
        sequence = pair_records.number(row, pair_records.SEQUENCE, label)
        source, target = (
            self._cloud(row, side, sequence, label)
            for side in (
                (pair_records.SOURCE, pair_records.SOURCE_FRAME),
                (pair_records.TARGET, pair_records.TARGET_FRAME),
            )
        )
        T = pair_records.transform_of(row, label)
        return PairFiles(
            id=f"{sequence:02d}/{source.stem}-{target.stem}",
            source=source,
            target=target,
            image=self._image(row, sequence, (source.stem, target.stem)),
            T_target_source=se3.inverse(T) if inverted else T,
            overlap=pair_records.overlap(row, label),
            source_sensor=source.parent.name,
            target_sensor=target.parent.name,
        )

    def _cloud(
        self,
        row: pair_records.Record,
        side: tuple[tuple[str, ...], tuple[str, ...]],
        sequence: int,
        label: str,
    ) -> Path:
        listed, frames = side
        named = pair_records.find(row, listed)
        if named is not None:
            return self._place(str(named), required_files.CLOUDS)
        frame = pair_records.number(row, frames, label)
        fan = self._fan = self._fan or self._which_is_the_fan(sequence, frame, label)
        spinning = next(name for name in _SENSORS if name != fan)
        folder = fan if listed == pair_records.SOURCE else spinning
        return self._place(f"sequences/{sequence:02d}/{folder}/{frame:06d}.ply", required_files.CLOUDS)

    def _image(self, row: pair_records.Record, sequence: int, frames: tuple[str, str]) -> Path | None:
        named = pair_records.find(row, pair_records.IMAGE)
        if isinstance(named, str):
            return self._place(named, required_files.IMAGES)
        folder = self.base / "sequences" / f"{sequence:02d}" / "image"
        found = (self.shelf.variant(folder / f"{frame}.jpg", required_files.IMAGES) for frame in frames)
        return next(filter(None, found), None)

    def _place(self, named: str, suffixes: tuple[str, ...]) -> Path:
        # Lists made on the authors' machine may contain their paths: the part from "sequences" on counts.
        parts = PurePosixPath(named.replace("\\", "/")).parts
        if "sequences" in parts:
            parts = parts[parts.index("sequences") :]
        path = self.base.joinpath(*parts)
        return self.shelf.variant(path, suffixes) or path

    def _which_is_the_fan(self, sequence: int, frame: int, label: str) -> str:
        folder = self.base / "sequences" / f"{sequence:02d}"
        for name in _SENSORS:
            file = self._place(f"sequences/{folder.name}/{name}/{frame:06d}.ply", required_files.CLOUDS)
            if azimuth.coverage(read_scan(file, name).points).role == "limited":
                return name
        cure = "name the clouds of each pair in the fields pcd0 (target) and pcd1 (source)"
        raise fault(
            label, f"names no clouds, and neither {' nor '.join(_SENSORS)} of {folder} is a fan", cure
        )
