# SPDX-License-Identifier: MIT
"""Pairs listed by their files: what every loader of a published data set makes."""

from __future__ import annotations

import inspect
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud
from hybridreg.data import spelling
from hybridreg.data.dataset import Dataset
from hybridreg.data.places import refuse_missing
from hybridreg.data.pth import read_pth
from hybridreg.io import read_image, read_points
from hybridreg.pair import LabelledPair, Pair

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class PairFiles:
    """Where one pair lies, and its true pose.

    Attributes
    ----------
    id : str
    source, target : Path
    T_target_source : (4, 4) float64
    image : Path or None
    overlap : float or None
        As the data set's own list tells it.
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

    def read(self) -> LabelledPair:
        """Read the pair's files."""
        pair = Pair(
            source=read_scan(self.source, f"{self.id} source", self.source_sensor),
            target=read_scan(self.target, f"{self.id} target", self.target_sensor),
            image=None if self.image is None else read_image(self.image),
            id=self.id,
            meta=dict(self.facts),
        )
        return LabelledPair(pair=pair, T_target_source=self.T_target_source, overlap=self.overlap)


class ListedPairs(Dataset):
    """A data set whose pairs are listed by their files; a pair is read when it is asked for.

    Parameters
    ----------
    entries : sequence of PairFiles
    origin : path
        What the list came from, for messages.
    if_inverted : str
        Where nobody has vouched for the poses' direction: what to do if they prove inverted. The first pair
        asked for then has up to 20 pairs' poses compared with their inverses (`hybridreg.data.direction`).
    overlap_radius : float
        Metres within which two points count as the same place: 0.5 outdoors.
    fields : tuple of str
        What the data set's own list calls its columns.

    Raises
    ------
    FileNotFoundError
        A listed file is not there.
    ValueError
        No entries, or two of one id.
    """

    def __init__(
        self,
        entries: Sequence[PairFiles],
        origin: Path,
        *,
        if_inverted: str = "",
        overlap_radius: float = 0.5,
        fields: tuple[str, ...] = (),
    ) -> None:
        self.entries, self.origin, self.fields = tuple(entries), origin, fields
        self.overlap_radius = overlap_radius
        self.if_inverted, self._direction_open = if_inverted, bool(if_inverted)
        if not self.entries:
            raise ValueError(f"{origin}: no pairs come of it; are its clouds and poses those of one drive?")
        self._ids = _unique([entry.id for entry in self.entries], origin)
        refuse_missing(_files(self.entries), str(origin))

    @classmethod
    def from_text(cls, text: str) -> ListedPairs:
        """Open a loader by "PATH" or "PATH#option,name=value"; options are its constructor's, in order."""
        loader: Callable[..., ListedPairs] = cls
        path, options = spelling.parse(text, inspect.signature(loader))
        return loader(path, **options)

    @property
    def ids(self) -> tuple[str, ...]:
        return self._ids

    def read(self, index: int) -> LabelledPair:
        """Read pair `index` as it is listed, without a look at the direction of its pose."""
        return self.entries[index].read()

    def load(self, index: int) -> LabelledPair:
        if self._direction_open:
            self.check()
            self._direction_open = False
        return self.read(index)

    def check(self) -> None:
        """Refuse poses of the wrong direction; runs before the first pair is handed out."""
        from hybridreg.data import direction

        direction.check(self, str(self.origin), self.if_inverted)

    def fingerprint(self) -> str:
        digest = 0
        for entry in self.entries:
            files = f"{entry.id} {entry.source.name} {entry.target.name}".encode()
            digest = zlib.crc32(files + np.round(entry.T_target_source, 9).tobytes(), digest)
        return f"{digest:08x}"


def read_scan(path: Path, name: str, sensor: str = "") -> PointCloud:
    """A cloud without its missing returns: not finite, or exactly at the sensor, as drivers write them."""
    points = read_pth(path) if path.suffix == ".pth" else np.array(read_points(path))
    points[~points.any(axis=1)] = np.nan
    try:
        return PointCloud.of(points, name=name, sensor=sensor, nonfinite="drop")
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _unique(ids: list[str], origin: Path) -> tuple[str, ...]:
    if len(set(ids)) < len(ids):
        seen: set[str] = set()
        double = next(i for i in ids if i in seen or seen.add(i))  # type: ignore[func-returns-value]
        raise ValueError(f"{origin}: lists the pair {double!r} {ids.count(double)} times; leave one of them")
    return tuple(ids)


def _files(entries: Sequence[PairFiles]) -> list[Path]:
    return [file for e in entries for file in (e.source, e.target, e.image) if file is not None]
