# SPDX-License-Identifier: MIT
"""A cloud as the evidence sees it: surfaces at a resolution of its own, range image, ground and its relief."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.cloud import PointCloud
from hybridreg.evidence.relief_repeats import repeats
from hybridreg.evidence.surface_distance import FineSurfaces
from hybridreg.geometry import ground, normals, se3
from hybridreg.geometry.ground import Ground
from hybridreg.geometry.ground_relief import Relief
from hybridreg.geometry.main_axes import balanced
from hybridreg.geometry.range_image import RangeImage, RangeImages
from hybridreg.resolution import default_voxel, map_cell
from hybridreg.runtime.side_by_side import side_by_side
from hybridreg.scene import SIDES, Scene, Side

Array = NDArray[np.float64]

# The evidence must mean the same whatever voxel the pipeline used, so it has its own. A level whose spacing differs by
# less than this factor is used as it is, with the normals and the tree that other stages computed; by hand.
_NEAR_ENOUGH = 1.5
# Points of such a level, at most: for speed.
_MOST_POINTS = 20_000
# Points that are sampled evenly for comparison: a share of 3,000 is good to one percent.
_N_ASKED = 3_000

# Distance between two sensors that stand at one place, of the median range of the target's points, at most; by hand.
_ONE_PLACE = 0.1


@dataclass(frozen=True, eq=False, kw_only=True)
class View:
    """Surfaces of one cloud.

    Attributes
    ----------
    points, normals : (n, 3) float64
    tree : KD-tree of the points
    image : RangeImage, RangeImages or None
        None where the sensor's place is not known.
    asked : (m,) int64
        Rows sampled for comparison with the other cloud.
    settling : (k,) int64
        Rows that settle a pose: surfaces that face each axis equally often, in random order.
    relief : Relief or None
        Of the ground; None where the cloud shows no ground.
    ground : Ground or None
        None where the cloud shows none, or where which side is up is unknown (gravity is not known).
    thickness : float
        Metres by which the ground may differ from a plane.
    centre : (3,) float64
        Where the cloud was seen from, or its middle.
    """

    points: Array
    normals: Array
    tree: cKDTree
    image: RangeImage | RangeImages | None
    asked: NDArray[np.int64]
    settling: NDArray[np.int64]
    relief: Relief | None
    ground: Ground | None
    thickness: float
    centre: Array

    @property
    def upward(self) -> Array:
        """The vertical (3,) in the cloud's frame; its z where no ground shows it."""
        return np.array([0.0, 0.0, 1.0]) if self.ground is None else self.ground.up

    def facing(self, rows: NDArray[np.int64]) -> Array:
        """Normals (k, 3) of some points."""
        return self.normals[rows]


@dataclass(frozen=True, eq=False, kw_only=True)
class Views:
    """Both clouds of a scene as the evidence looks at them.

    Attributes
    ----------
    spacing : float
        Resolution of the evidence, metres.
    """

    scene: Scene
    source: View
    target: View
    spacing: float

    @property
    def up(self) -> Array | None:
        """The vertical (3,) in the target's frame, where both clouds show their ground; else None."""
        if self.source.ground is None or self.target.ground is None:
            return None
        return self.target.ground.up

    def from_one_place(self, T_target_source: Array) -> bool:
        """Whether a pose (4, 4) puts the sensors of both clouds, where it is known where they stood, at one place."""
        if self.source.image is None or self.target.image is None:
            return False
        apart = se3.apply(T_target_source, self.source.centre[None])[0] - self.target.centre
        ranges = np.linalg.norm(self.target.points[self.target.asked] - self.target.centre, axis=1)
        return bool(np.linalg.norm(apart) < _ONE_PLACE * np.median(ranges))

    def vertical(self, axes: Array) -> Array:
        """The vertical (3,), or where it is not known the commonest of the directions (3, 3) that surfaces face."""
        return axes[0] if self.up is None else self.up

    @cached_property
    def fine(self) -> FineSurfaces:
        """Surfaces as fine as the clouds show them."""
        return FineSurfaces.of(self.scene.pair)

    @cached_property
    def relief_repeats(self) -> float:
        """How much the ground's relief is like itself elsewhere, of the cloud in which it is so most; a correlation."""
        reliefs = (view.relief for view in (self.source, self.target))
        return max((repeats(relief) for relief in reliefs if relief is not None), default=0.0)

    @cached_property
    def middle(self) -> Array:
        """Centroid of the source's points, (1, 3)."""
        return self.source.points.mean(axis=0, keepdims=True)


def of(scene: Scene) -> Views:
    """The views of a scene, made once a run."""
    return scene.shared("views", lambda: _both(scene))


def _both(scene: Scene) -> Views:
    spacing = default_voxel(scene.pair.source, scene.pair.target)
    on_grid = scene.at(map_cell(scene.pair.source, scene.pair.target))

    def view(side: Side) -> View:
        turned = on_grid.grounds[side] is not on_grid.level(side).ground
        key = ("view", spacing, scene.level(side).spacing, on_grid.spacing, scene.pair.gravity, turned)
        cloud: PointCloud = getattr(scene.pair, side)
        return cloud.once(key, partial(_view, scene, side, spacing, on_grid))

    source, target = side_by_side(view, *SIDES)  # most of it is sorting and trees
    return Views(scene=scene, source=source, target=target, spacing=spacing)


def _view(scene: Scene, side: Side, wanted: float, on_grid: Scene) -> View:
    level = scene.level(side)
    if len(level) <= _MOST_POINTS and 1 / _NEAR_ENOUGH < level.spacing / wanted < _NEAR_ENOUGH:
        points, tree, surface = level.points, level.tree, level.normals()
    else:
        from hybridreg.geometry.voxel_cells import voxel_centroids

        points = voxel_centroids(getattr(scene.pair, side).points, wanted)
        tree, surface = cKDTree(points), normals.estimate(points, level.viewpoint)
    asked = np.unique(np.linspace(0, len(points) - 1, min(_N_ASKED, len(points))).astype(np.int64))
    return View(
        points=points,
        normals=surface,
        tree=tree,
        image=getattr(scene.pair, side).range_image,
        asked=asked,
        settling=balanced(surface, _N_ASKED),
        relief=_relief(scene, side, on_grid),
        ground=_upright_ground(on_grid, side, points, surface, wanted)
        if scene.pair.gravity == "known"
        else None,
        thickness=ground.thickness(points, wanted),
        centre=level.centre,
    )


def _upright_ground(
    on_grid: Scene, side: Side, points: Array, surface: Array, spacing: float
) -> Ground | None:
    # Its upper side is that of the sensor; where nobody said where that stood, of what stands on it too. Not in a room,
    # where what reaches from the floor to the ceiling stands on both: the view's `points` (n, 3) have normals, and show
    # the other side.
    found, level = on_grid.grounds[side], on_grid.level(side)
    first = level.ground  # of two that face one another, whichever of them was taken
    if (
        found is None
        or first is None
        or level.viewpoint is None
        or getattr(on_grid.pair, side).said is not None
    ):
        return found
    facing = ground.facing(points, surface, first, spacing)
    if facing is not None and float(facing.above(level.centre[None])[0]) > 0.0:
        return found
    by_content = ground.under(level.points, None, level.spacing)
    return found if by_content is not None and float(by_content.up @ found.up) > 0.5 else None


def _relief(scene: Scene, side: Side, on_grid: Scene) -> Relief | None:
    found, level = on_grid.grounds[side], on_grid.level(side)
    if found is None:
        return None
    return Relief.of(getattr(scene.pair, side).points, level.centre, found, level.spacing)
