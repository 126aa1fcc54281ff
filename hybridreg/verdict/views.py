# SPDX-License-Identifier: MIT
"""One cloud as the verdict looks at it: surfaces at a resolution of its own, and what the sensor saw."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg import normals
from hybridreg.classical import ground
from hybridreg.range_image import RangeImage
from hybridreg.resolution import default_voxel, map_cell
from hybridreg.resources import n_workers
from hybridreg.scene import Level, Scene
from hybridreg.verdict.axes import balanced
from hybridreg.verdict.relief import Relief

Array = NDArray[np.float64]
Side = Literal["source", "target"]

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
    image : RangeImage or None
        None where the sensor's place is not known.
    asked : (m,) int64
        Rows that are compared with the other cloud.
    settling : (k,) int64
        Rows by which a pose settles: surfaces that face each way equally often, in random order.
    relief : Relief or None
        Of the ground; None where the cloud shows none.
    """

    points: Array
    normals: Array
    tree: cKDTree
    image: RangeImage | None
    asked: NDArray[np.int64]
    settling: NDArray[np.int64]
    relief: Relief | None


def views(scene: Scene) -> tuple[View, View]:
    """Source and target of a scene, made once a run."""
    return scene.shared(("verdict", "views"), lambda: _both(scene))


def spacing(scene: Scene) -> float:
    """Resolution of the evidence, metres."""
    return scene.shared(("verdict", "spacing"), lambda: default_voxel(scene.pair.source, scene.pair.target))


def _both(scene: Scene) -> tuple[View, View]:
    wanted = spacing(scene)
    on_grid = ground.on_grid(scene, map_cell(scene.pair.source, scene.pair.target))
    # Side by side: most of it is sorting and trees, which each take one thread.
    with ThreadPoolExecutor(min(2, n_workers())) as pool:
        source = pool.submit(_view, scene, "source", wanted, on_grid)
        target = pool.submit(_view, scene, "target", wanted, on_grid)
        return source.result(), target.result()


def _view(scene: Scene, side: Side, wanted: float, on_grid: Scene) -> View:
    level: Level = getattr(scene, side)
    if len(level) <= _MOST_POINTS and 1 / _NEAR_ENOUGH < level.spacing / wanted < _NEAR_ENOUGH:
        points, tree, surface = level.points, normals.tree(scene, side), normals.of(scene, side)
    else:
        from hybridreg.classical.voxel import voxel_centroids

        points = voxel_centroids(getattr(scene.pair, side).points, wanted)
        tree, surface = cKDTree(points), normals.estimate(points, level.viewpoint)
    asked = np.unique(np.linspace(0, len(points) - 1, min(_N_ASKED, len(points))).astype(np.int64))
    return View(
        points=points,
        normals=surface,
        tree=tree,
        image=_image(scene, side),
        asked=asked,
        settling=balanced(surface, _N_ASKED),
        relief=_relief(scene, side, on_grid),
    )


def _relief(scene: Scene, side: Side, on_grid: Scene) -> Relief | None:
    found, level = ground.find(on_grid, side), getattr(on_grid, side)
    if found is None or level.viewpoint is None:
        return None
    return Relief.of(getattr(scene.pair, side).points, level.viewpoint, found, level.spacing)


def _image(scene: Scene, side: Side) -> RangeImage | None:
    cloud = getattr(scene.pair, side)
    viewpoint = cloud.viewpoint
    if viewpoint is None:
        return None
    return scene.shared(("range image", side), lambda: RangeImage.of(cloud.points, viewpoint))
