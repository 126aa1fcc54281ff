# SPDX-License-Identifier: MIT
"""The files of pairs, one by one and as a table that is quickly sent between processes."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud
from hybridreg.data.lists.pth import read_pth
from hybridreg.io import check_image, read_points
from hybridreg.pair import LabelledPair, Pair

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class PairFiles:
    """The files of one pair, and its true pose.

    Attributes
    ----------
    id : str
    source, target : Path
    T_target_source : (4, 4) float64
    image : Path or None
    overlap : float or None
        From the data set's own list.
    source_sensor, target_sensor : str
    facts : mapping
        For reports; becomes `pair.meta`.
    """

    id: str
    source: Path
    target: Path
    T_target_source: Array
    image: Path | None = None
    overlap: float | None = None
    source_sensor: str = ""
    target_sensor: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)

    def files(self) -> tuple[Path, Path, Path | None]:
        """Source, target, and the image where there is one."""
        return self.source, self.target, self.image

    def read(self) -> LabelledPair:
        """Read the pair's files."""
        pair = Pair(
            source=read_scan(self.source, f"{self.id} source", self.source_sensor),
            target=read_scan(self.target, f"{self.id} target", self.target_sensor),
            image=None if self.image is None else _checked(self.image),
            id=self.id,
            meta=dict(self.facts),
        )
        return LabelledPair(pair=pair, T_target_source=self.T_target_source, overlap=self.overlap)


class PairTable(Sequence[PairFiles]):
    """Pairs column by column.

    Every task of a parallel run carries its data set: ten thousand `Path`s take a second to pickle,
    their texts a hundredth of it.
    """

    def __init__(self, entries: Iterable[PairFiles]) -> None:
        rows = list(entries)
        self.ids = tuple(row.id for row in rows)
        self._T = np.array([row.T_target_source for row in rows]).reshape(-1, 4, 4)
        self._files = [tuple(None if f is None else str(f) for f in row.files()) for row in rows]
        self._sensors = [(row.source_sensor, row.target_sensor) for row in rows]
        self._facts = [(row.overlap, dict(row.facts) or None) for row in rows]

    def __len__(self) -> int:
        return len(self.ids)

    def digest(self) -> int:
        """Changes with the names of the pairs or their poses, not with the location of the files."""
        return zlib.crc32(repr(self.ids).encode(), zlib.crc32(np.round(self._T, 9).tobytes()))

    def paths(self, index: int) -> list[str]:
        """Files of pair `index`."""
        return [file for file in self._files[index] if file is not None]

    @overload
    def __getitem__(self, index: int) -> PairFiles: ...

    @overload
    def __getitem__(self, index: slice) -> list[PairFiles]: ...

    def __getitem__(self, index: int | slice) -> PairFiles | list[PairFiles]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        source, target, image = self._files[index]
        overlap, facts = self._facts[index]
        return PairFiles(
            id=self.ids[index],
            source=Path(str(source)),
            target=Path(str(target)),
            image=None if image is None else Path(image),
            T_target_source=self._T[index],
            overlap=overlap,
            source_sensor=self._sensors[index][0],
            target_sensor=self._sensors[index][1],
            facts=facts or {},
        )


def _checked(image: Path) -> Any:
    # Decoded when a stage reads it.
    check_image(image)
    return image


def read_scan(path: Path, name: str, sensor: str = "") -> PointCloud:
    """A cloud without its missing returns: not finite, or exactly at the sensor, as drivers write them."""
    points = read_pth(path) if path.suffix == ".pth" else np.array(read_points(path))
    points[~points.any(axis=1)] = np.nan
    try:
        return PointCloud.of(points, name=name, sensor=sensor, nonfinite="drop")
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
