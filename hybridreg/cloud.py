# SPDX-License-Identifier: MIT
"""The point cloud that every stage receives."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from hybridreg import gate
from hybridreg.geometry import extent
from hybridreg.geometry.range_image import RangeImage, RangeImages
from hybridreg.geometry.viewpoint import Given, Seen, found, given
from hybridreg.io import read_recorded, read_viewpoint
from hybridreg.io.arrays import array_points
from hybridreg.io.recorded import ros_messages
from hybridreg.io.recorded.recording import ANY, Recorded, Selection

Array = NDArray[np.float64]
Value = TypeVar("Value")

# Coordinates above this are a map grid's, not a sensor's: 10 km leaves float32 code 1 mm of resolution.
_MAP_GRID = 1e4
# Points between which a cloud has an `apart`: by hand.
_SPARSE = (2_000, 20_000)


@dataclass(frozen=True, eq=False, kw_only=True)
class PointCloud:
    """Points of one sensor, in metres.

    Attributes
    ----------
    points : (N, 3) float64, read-only
        Coordinates minus `offset`.
    sensor : str
        Free text, for reports.
    offset : (3,) float64
        Whole kilometres subtracted from the user's coordinates; zero for a cloud in its sensor's frame.
    dropped : int
        Points dropped on request: not finite, or missing returns.
    said : Seen or None
        Where it was seen from, as a caller or a data set says; None has `guess` tested.
    guess : (3,) float64 or None
        The viewpoint to test: the one in the file, or the frame's origin.
    kept : dict or None
        Of a prepared target (`hybridreg.many.target`), what `once` keeps for the next registration.
    """

    points: Array
    sensor: str = ""
    offset: Array = field(default_factory=lambda: np.zeros(3))
    dropped: int = 0
    said: Seen | None = None
    guess: Array | None = None
    kept: dict[Hashable, Any] | None = field(default=None, repr=False)

    @classmethod
    def of(
        cls,
        x: Any,
        *,
        name: str = "cloud",
        sensor: str = "",
        nonfinite: Literal["raise", "drop"] = "raise",
        viewpoint: Given = "auto",
        select: Selection = ANY,
    ) -> PointCloud:
        """Check and convert anything that holds points: the library's only entrance for clouds.

        Parameters
        ----------
        x : path, array, table or object that holds points
            Arrays and tensors (N, 3+), (3 to 6, N) or (H, W, 3+); records, tables and dictionaries with x, y and z by
            name; ROS's PointCloud2 and LaserScan, clouds of laspy and Open3D, and whatever else has `points`
            (`hybridreg.io.point_objects`). Metres, unless a name gives another unit, as in `X (mm)`. Masked or missing
            values count as not finite.
        name : str
            What error messages call the cloud.
        nonfinite : "raise" or "drop"
            What to do with points that are not finite; in ROS's messages and bags they are missing returns, and always
            dropped. "drop" also drops points exactly at one place, where they are 1 % of the points or more: drivers
            write the origin for missing returns, and a pose moves it; and ends of simulated rays that met nothing, at
            one longest range in all directions. "raise" warns of them.
        viewpoint : "auto", "none", (3,), (N, 3), or ((k, 3), (N,))
            Where the sensor stood, in the coordinates of the points: one place, one for each point, or places and the
            row of each point's. "none" is right for a map, a CAD model or a merged cloud whose viewpoints are unknown:
            free space is then not tested. "auto" takes the viewpoint in the file, or tests whether a sensor may have
            stood at the origin (`hybridreg.geometry.viewpoint`).
        select : Selection
            Which cloud of a file that holds several: of a bag, an E57 file.

        Raises
        ------
        ValueError
            Naming the cloud, the number that is wrong and a cure.
        """
        x = gate.answering(x, name)
        x = getattr(x, "prepared", x)
        if isinstance(x, PointCloud):
            gate.check(x.points, name)
            said = given(viewpoint, len(x), name)
            return x if said is None else replace(x, said=said.less(x.offset))
        recorded, place = Recorded(np.empty((0, 3))), None
        if isinstance(x, (str, os.PathLike)):
            recorded = read_recorded(x, select)
            place = recorded.guess if recorded.guess is not None else read_viewpoint(x)
        raw = recorded.points if isinstance(x, (str, os.PathLike)) else gate.coordinates(x, name)
        # A scan of ROS has its missing returns in it, in a bag or in hand.
        drop = nonfinite == "drop" or recorded.holed or ros_messages.is_cloud(x)
        kept, rows = gate.finite(raw, name, drop=drop)
        kept, rows = gate.returned(kept, rows, name, drop=drop)
        gate.columns(kept, name)
        gate.rounded(kept if recorded.corners is None else recorded.corners, name)
        said = given(viewpoint, len(raw), name)
        if recorded.places is not None and isinstance(viewpoint, str) and viewpoint == "auto":
            words = "as its file says" if len(recorded.places) else "a surface, which no sensor saw"
            said = Seen(recorded.places, recorded.of_point, words)
        offset = _whole_kilometres(kept)
        points = kept - offset if offset.any() else kept  # already a copy of the caller's
        gate.check(points, name)
        points.setflags(write=False)
        return cls(
            points=points,
            sensor=sensor,
            offset=offset,
            dropped=len(raw) - len(kept),
            said=None if said is None else said.of(rows).less(offset),
            guess=None if place is None else place - offset,
        )

    def keeping(self) -> PointCloud:
        """The cloud as a prepared target: `once` keeps what it makes."""
        return replace(self, kept={})

    def once(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """`make()`; of a prepared target what it gave the first time."""
        if self.kept is None:
            return make()
        if key not in self.kept:
            self.kept[key] = make()
        value: Value = self.kept[key]
        return value

    def __getstate__(self) -> dict[str, Any]:
        # What is found out again need not travel between processes.
        return {**self.__dict__, "kept": None if self.kept is None else {}}

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper corner, each (3,), of the box around the points."""
        return extent.bounds(self.points)

    @cached_property
    def apart(self) -> float:
        """Median distance of nearest neighbours, metres; 0 where there are so many points that it is short beside their
        extent, or so few that it says more about what was left out."""
        return extent.apart(self.points) if _SPARSE[0] <= len(self) <= _SPARSE[1] else 0.0

    @cached_property
    def radii(self) -> Array:
        """Distances from the cloud's middle, the shortest first, metres: (N,), at most a million."""
        return extent.radii(self.points)

    @cached_property
    def seen(self) -> Seen:
        """Where the cloud was seen from, and how that is known: as given, or from the test of the origin."""
        return found(self.points, self.guess) if self.said is None else self.said

    @property
    def viewpoint(self) -> Array | None:
        """Where the sensor stood: (3,), (k, 3) for several viewpoints, or None where it is not known; minus
        `offset`."""
        places = self.seen.places
        return None if len(places) == 0 else places[0] if len(places) == 1 else places

    @cached_property
    def range_image(self) -> RangeImage | RangeImages | None:
        """What the sensor saw in each direction; None where its viewpoint is not known."""
        places, of_point, _ = self.seen
        if len(places) == 0:
            return None
        if of_point is None:
            return RangeImage.of(self.points, places[0])
        return RangeImages.of(self.points, places, of_point)


def rows_of(x: Any, name: str) -> Array:
    """Every row (N, 3) of what `PointCloud.of` takes, in its own coordinates: few points or missing ones too."""
    x = gate.answering(x, name)
    x = getattr(x, "prepared", x)
    if isinstance(x, PointCloud):
        rows: Array = x.points + x.offset
        return rows
    if isinstance(x, (str, os.PathLike)):
        return read_recorded(x, ANY).points
    if isinstance(x, (np.ndarray, list, tuple)):
        return array_points(np.asarray(x), name)
    return gate.coordinates(x, name)


def _whole_kilometres(points: Array) -> Array:
    # Whole kilometres, so that a cloud moved to a map grid by a round number gets back exactly the coordinates it had,
    # with its sensor at the origin. The median, because a stray return may lie anywhere.
    if len(points) == 0:
        return np.zeros(3)
    middle = np.median(extent.some(points), axis=0)
    return np.where(np.abs(middle) > _MAP_GRID, np.round(middle, -3), 0.0)
