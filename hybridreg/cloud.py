# SPDX-License-Identifier: MIT
"""The point cloud that every stage receives."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hybridreg import extent, gate

Array = NDArray[np.float64]

# Coordinates above this are a map grid's, not a sensor's: 10 km leaves float32 code 1 mm of resolution.
_MAP_GRID = 1e4


@dataclass(frozen=True, eq=False, kw_only=True)
class PointCloud:
    """Points of one sensor, in metres.

    Attributes
    ----------
    points : (N, 3) float64, read-only
        Coordinates with `offset` taken off.
    sensor : str
        Free text, for reports.
    offset : (3,) float64
        Whole kilometres taken off the coordinates that the user gave; zero for a cloud in its sensor's frame.
    dropped : int
        Non-finite points left out on request.
    """

    points: Array
    sensor: str = ""
    offset: Array = field(default_factory=lambda: np.zeros(3))
    dropped: int = 0

    @classmethod
    def of(
        cls, x: Any, *, name: str = "cloud", sensor: str = "", nonfinite: Literal["raise", "drop"] = "raise"
    ) -> PointCloud:
        """Check and convert anything that holds points: the one gate of the library.

        Parameters
        ----------
        x : path, (N, 3+) array or nested list, torch tensor, Open3D cloud (legacy or tensor), PointCloud
            Coordinates in metres in the first three columns.
        name : str
            What error messages call the cloud.
        nonfinite : "raise" or "drop"
            What to do with points that are not finite.

        Raises
        ------
        ValueError
            Naming the cloud, the number that is wrong and the cure.
        """
        if isinstance(x, PointCloud):
            gate.check(x.points, name)
            return x
        raw = gate.coordinates(x, name)
        kept = gate.finite(raw, name, drop=nonfinite == "drop")
        offset = _whole_kilometres(kept)
        points = kept - offset
        gate.check(points, name)
        points.setflags(write=False)
        return cls(points=points, sensor=sensor, offset=offset, dropped=len(raw) - len(kept))

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper corner, each (3,), of the box around the points."""
        return extent.bounds(self.points)

    @cached_property
    def radii(self) -> Array:
        """Distances (N,) from the cloud's middle, the shortest first, metres."""
        return extent.radii(self.points)

    @cached_property
    def viewpoint(self) -> Array | None:
        """Where the sensor stood, (3,): the origin of its frame, or None where that lies far from the points."""
        low, high = self.bounds
        margin = 0.1 * float(np.linalg.norm(high - low))
        inside = bool(np.all(low - margin <= 0.0) and np.all(high + margin >= 0.0))
        return np.zeros(3) if inside else None


def _whole_kilometres(points: Array) -> Array:
    # Whole kilometres, so that a cloud moved to a map grid by a round number comes back to the very coordinates
    # it had, its sensor at the origin again. The median, because a stray return may lie anywhere.
    if len(points) == 0:
        return np.zeros(3)
    middle = np.median(points, axis=0)
    return np.where(np.abs(middle) > _MAP_GRID, np.round(middle, -3), 0.0)
