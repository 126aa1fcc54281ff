# SPDX-License-Identifier: MIT
"""A pair after downsampling, with what the stages of one run share."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.cloud import PointCloud
from hybridreg.geometry import ground, normals
from hybridreg.geometry import viewpoint as seen_from
from hybridreg.geometry.ground import Ground
from hybridreg.geometry.voxel_cells import voxel_centroids
from hybridreg.matches import Correspondences
from hybridreg.pair import Pair
from hybridreg.runtime.resources import Clock
from hybridreg.runtime.side_by_side import side_by_side
from hybridreg.thinning import thinned

Array = NDArray[np.float64]
Side = Literal["source", "target"]
SIDES: tuple[Side, Side] = ("source", "target")
Value = TypeVar("Value")


@dataclass(frozen=True, eq=False, kw_only=True)
class Level:
    """One downsampled cloud, and what is found out about it once a run.

    Attributes
    ----------
    points : (n, 3) float64
        In the frame of the pair's cloud (its offset taken off), metres.
    spacing : float
        Typical distance of neighbours, metres: the voxel where a grid made the level.
    viewpoint : (3,), (k, 3) of several places, or None
        Where the sensor stood.
    """

    points: Array
    spacing: float
    viewpoint: Array | None = None
    _kept: dict[Hashable, Any] = field(default_factory=dict, repr=False)

    @classmethod
    def on_cells(cls, cloud: PointCloud, voxel: float, name: str = "cloud") -> Level:
        """A cloud's level of the centroids of a grid's cells of one edge, metres; `name` is what an error calls it."""
        points = voxel_centroids(cloud.points, voxel, name)
        return cls(points=points, spacing=voxel, viewpoint=cloud.viewpoint)

    def __len__(self) -> int:
        return len(self.points)

    def __getstate__(self) -> dict[str, Any]:
        # What is found out again in no time need not travel between processes.
        return {name: self.__dict__[name] for name in ("points", "spacing", "viewpoint")} | {"_kept": {}}

    @cached_property
    def tree(self) -> cKDTree:
        """KD-tree of the points."""
        return cKDTree(self.points)

    @cached_property
    def ground(self) -> Ground | None:
        """The ground that the cloud shows; None where no plane carries enough of its points."""
        return ground.under(self.points, self.viewpoint, self.spacing)

    @cached_property
    def facing_ground(self) -> Ground | None:
        """The ceiling over its floor, or the floor under what was taken for the ground (`ground.facing`)."""
        found = self.ground
        return None if found is None else ground.facing(self.points, self.normals(), found, self.spacing)

    @cached_property
    def centre(self) -> Array:
        """Where the cloud was seen from, (3,): the middle of several places; of the points where none is known."""
        return seen_from.centre(self.points, self.viewpoint)

    def normals(self, k: int = 20) -> Array:
        """Normals (n, 3) from each point's k nearest neighbours, towards the sensor."""
        return self.once(("normals", k), lambda: normals.estimate(self.points, self.viewpoint, k))

    def once(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return `make()`, computed once for each key (normals, descriptors): of a prepared target, once for all."""
        if key not in self._kept:
            self._kept[key] = make()
        value: Value = self._kept[key]
        return value


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """What downsampling gives, and every later stage receives.

    Attributes
    ----------
    pair : Pair
    source, target : Level
    notes : list of str
        What a stage wants the user to read in the result: a default it chose, a cap that bit.
    explanations : list of str
        Mistakes of the user's under which the clouds would fit: what the verdict's reasons begin with.
    matches : list of Correspondences
        What the run's matchers found so far, each with one match at least.
    clock : Clock
        Where the time of the run goes.
    """

    pair: Pair
    source: Level
    target: Level
    notes: list[str] = field(default_factory=list)
    explanations: list[str] = field(default_factory=list)
    matches: list[Correspondences] = field(default_factory=list)
    clock: Clock = field(default_factory=Clock, repr=False)
    _shared: dict[Hashable, Any] = field(default_factory=dict, repr=False)
    _grids: dict[float, Scene] = field(default_factory=dict, repr=False)

    @classmethod
    def on_cells(cls, pair: Pair, voxel: float) -> Scene:
        """Both clouds as the centroids of a grid's cells of one edge, metres."""
        clouds = thinned(pair, voxel)

        def level(side: Side) -> Level:
            cloud: PointCloud = getattr(clouds, side)
            return cloud.once(("level", voxel), partial(Level.on_cells, cloud, voxel, side))

        source, target = side_by_side(level, *SIDES)
        return cls(pair=clouds, source=source, target=target)

    def at(self, voxel: float) -> Scene:
        """The same pair on a grid of another edge, made once a run."""
        if voxel not in self._grids:
            self._grids[voxel] = Scene.on_cells(self.pair, voxel)
        return self._grids[voxel]

    def level(self, side: Side) -> Level:
        """The source's level or the target's."""
        return self.source if side == "source" else self.target

    @cached_property
    def grounds(self) -> dict[Side, Ground | None]:
        """The ground of each cloud: two floors, or two ceilings.

        Indoors a sensor may see more of the ceiling than of the floor. Sensors and maps are more often upright than
        upside down, so where one ground lies over its sensor and the other does not, one cloud shows its other side.
        """
        found = {side: self.level(side).ground for side in SIDES}
        upright = {side: one is not None and one.up[2] > 0.0 for side, one in found.items()}
        if None in found.values() or len(set(upright.values())) == 1 or self.pair.gravity != "known":
            return found
        for side in sorted(SIDES, key=upright.__getitem__):
            other = self.level(side).facing_ground
            if other is not None:
                return {**found, side: other}
        return found

    @property
    def spacing(self) -> float:
        """The coarser of the two levels' spacings, metres: the resolution at which the clouds can be compared."""
        return max(self.source.spacing, self.target.spacing)

    def shared(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return `make()`, computed once a run for each key: what both clouds give together."""
        if key not in self._shared:
            self._shared[key] = make()
        value: Value = self._shared[key]
        return value

    def release(self) -> None:
        """Forget what the stages of a finished run shared. It points back at the scene, so that its memory would
        otherwise wait for the garbage collector, which comes by the number of objects and not by their size."""
        self._shared.clear()
        for scene in self._grids.values():
            scene.release()
        self._grids.clear()

    def matched(self, found: Correspondences) -> Correspondences:
        """Remember what a matcher found, as evidence for or against every pose."""
        if len(found):
            self.matches.append(found)
        return found

    def note(self, text: str) -> None:
        """Leave a sentence for the result, once."""
        if text not in self.notes:
            self.notes.append(text)
