# SPDX-License-Identifier: MIT
"""Where the files of Cross3DReg's archive lie, of which nothing but the folders' names is known for certain."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

import numpy as np

from hybridreg.data.lists import azimuth, pair_records, required_files
from hybridreg.data.lists.pair_files import PairFiles, read_scan
from hybridreg.geometry import se3
from hybridreg.io.faults import fault

SENSORS = ("lidar", "array")  # the archive does not say which of the two spins
_SIDES = {
    "source": (pair_records.SOURCE, pair_records.SOURCE_FRAME),
    "target": (pair_records.TARGET, pair_records.TARGET_FRAME),
}


@dataclass
class SequenceArchive:
    """`sequences/NAME/{lidar,array,image}` below `base`, asked for the files of one pair after the other.

    Attributes
    ----------
    inverted : the list's poses map target to source
    swap : the list's cloud 0 is the source and its cloud 1 the target; the poses keep their meaning between the clouds
    """

    base: Path
    inverted: bool = False
    swap: bool = False
    shelf: required_files.Shelf = field(default_factory=required_files.Shelf)
    _fan: str = ""

    def entry(self, row: pair_records.Record, label: str) -> PairFiles:
        """Files and pose of a pair.

        Raises
        ------
        ValueError
            A field is missing or holds what it cannot; the message names it.
        """
        sequence = pair_records.sequence(row, label)
        clouds = {side: self._cloud(row, side, sequence, label) for side in _SIDES}
        T = pair_records.transform_of(row, label)
        T = se3.inverse(T) if self.inverted else T
        source, target = clouds["source"], clouds["target"]
        if self.swap:
            source, target, T = target, source, se3.inverse(T)
        return PairFiles(
            id=f"{sequence}/{source.stem}-{target.stem}",
            source=source,
            target=target,
            image=self._image(row, sequence, (source.stem, target.stem)),
            T_target_source=T,
            overlap=pair_records.overlap(row, label),
            source_sensor=source.parent.name,
            target_sensor=target.parent.name,
        )

    def _cloud(self, row: pair_records.Record, side: str, sequence: str, label: str) -> Path:
        fields, frames = _SIDES[side]
        named = _text(pair_records.find(row, fields))
        if named is not None and not _is_bare(named):
            return self._place(named, sequence, required_files.CLOUDS)
        frame = named or f"{pair_records.number(row, frames, label):06d}.ply"
        # Told by its frame alone, a source is of the sensor that is a fan, whichever folder that is.
        fan = self._fan = self._fan or self._which_is_the_fan(sequence, label)
        spinning = next(name for name in SENSORS if name != fan)
        folder = fan if (side == "source") != self.swap else spinning
        return self._place(f"sequences/{sequence}/{folder}/{frame}", sequence, required_files.CLOUDS)

    def _image(self, row: pair_records.Record, sequence: str, frames: tuple[str, str]) -> Path | None:
        named = _text(pair_records.find(row, pair_records.IMAGE))
        if named is not None:
            bare = f"sequences/{sequence}/image/{named}" if _is_bare(named) else named
            return self._place(bare, sequence, required_files.IMAGES)
        folder = self.base / "sequences" / sequence / "image"
        found = (self.shelf.variant(folder / f"{frame}.jpg", required_files.IMAGES) for frame in frames)
        return next(filter(None, found), None)

    def _place(self, named: str, sequence: str, suffixes: tuple[str, ...]) -> Path:
        # Lists made on the authors' machine may hold their paths: what counts begins at "sequences", or at the sensor.
        parts = PurePosixPath(named.replace("\\", "/")).parts
        known = "sequences" in parts
        parts = parts[parts.index("sequences") :] if known else parts
        candidates = [self.base.joinpath(*parts)]
        if not known:
            candidates.append(self.base.joinpath("sequences", *parts[-3:]))
        if len(parts) == 2:
            candidates.append(self.base.joinpath("sequences", sequence, *parts))
        found = (self.shelf.variant(path, suffixes) for path in candidates)
        return next(filter(None, found), candidates[0])

    def _which_is_the_fan(self, sequence: str, label: str) -> str:
        folder = self.base / "sequences" / sequence
        for name in SENSORS:
            files = sorted(f for f in (folder / name).glob("*") if f.suffix.lower() in required_files.CLOUDS)
            if files and azimuth.coverage(read_scan(files[0], name).points).role == "limited":
                return name
        cure = "name the clouds of each pair in the fields pcd0 (target) and pcd1 (source)"
        raise fault(label, f"names no clouds, and neither {' nor '.join(SENSORS)} of {folder} is a fan", cure)


def _text(value: object) -> str | None:
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.item()
    return str(value) if isinstance(value, (str, Path)) else None


def _is_bare(named: str) -> bool:
    return len(PurePosixPath(named.replace("\\", "/")).parts) == 1
