# SPDX-License-Identifier: MIT
"""One cloud as the verdict looks at it: surfaces at a resolution of its own, and what the sensor saw."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.geometry import ground, normals
from hybridreg.geometry.ground import Ground
from hybridreg.geometry.ground_relief import Relief
from hybridreg.geometry.main_axes import balanced
from hybridreg.geometry.range_image import RangeImage, RangeImages
from hybridreg.resolution import default_voxel, map_cell
from hybridreg.runtime.cores import n_threads
from hybridreg.scene import Scene, Side

Array = NDArray[np.float64]

# The evidence must mean the same whatever voxel the pipeline used, so it has its own; a level that comes near
# enough is used as it is, with the normals and the tree that other stages already computed.
_NEAR_ENOUGH = 1.5
_MOST_POINTS = 20_000
# Points that are asked about, spread evenly over the level: a share of 3,000 is good to one percent.
_N_ASKED = 3_000


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
        Rows that are compared with the other cloud.
    settling : (k,) int64
        Rows by which a pose settles: surfaces that face each way equally often, in random order.
    relief : Relief or None
        Of the ground; None where the cloud shows none.
    ground : Ground or None
        None where the cloud shows none, or where its upper side tells nothing (gravity is not known).
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

    def facing(self, rows: NDArray[np.int64]) -> Array:
        """Normals (k, 3) of some points."""
        return self.normals[rows]


def views(scene: Scene) -> tuple[View, View]:
    """Source and target of a scene, made once a run."""
    return scene.shared(("verdict", "views"), lambda: _both(scene))


def spacing(scene: Scene) -> float:
    """Resolution of the evidence, metres."""
    return scene.shared(("verdict", "spacing"), lambda: default_voxel(scene.pair.source, scene.pair.target))


def _both(scene: Scene) -> tuple[View, View]:
    wanted = spacing(scene)
    on_grid = scene.at(map_cell(scene.pair.source, scene.pair.target))
    # Side by side: most of it is sorting and trees, which each take one thread.
    with ThreadPoolExecutor(min(2, n_threads())) as pool:
        source = pool.submit(_view, scene, "source", wanted, on_grid)
        key = ("view", wanted, scene.target.spacing, on_grid.spacing, scene.pair.gravity)
        make = partial(_view, scene, "target", wanted, on_grid)
        target = pool.submit(scene.pair.target.once, key, make)
        return source.result(), target.result()


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
        ground=_upright_ground(on_grid, side) if scene.pair.gravity == "known" else None,
        thickness=ground.thickness(points, wanted),
        centre=level.centre,
    )


def _upright_ground(on_grid: Scene, side: Side) -> Ground | None:
    # Its upper side is that of the sensor; where nobody said where that stood, of what stands on it too.
    found, level = on_grid.level(side).ground, on_grid.level(side)
    if found is None or level.viewpoint is None or getattr(on_grid.pair, side).said is not None:
        return found
    by_content = ground.under(level.points, None, level.spacing)
    return found if by_content is not None and float(by_content.up @ found.up) > 0.5 else None


def _relief(scene: Scene, side: Side, on_grid: Scene) -> Relief | None:
    found, level = on_grid.level(side).ground, on_grid.level(side)
    if found is None:
        return None
    return Relief.of(getattr(scene.pair, side).points, level.centre, found, level.spacing)
