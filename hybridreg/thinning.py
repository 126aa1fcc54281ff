# SPDX-License-Identifier: MIT
"""Clouds of many millions of points, thinned to what any stage can resolve: they cost no more than others."""

from __future__ import annotations

from dataclasses import replace

from hybridreg.cloud import PointCloud
from hybridreg.geometry.extent import reach, some
from hybridreg.geometry.voxel_cells import voxel_cells, voxel_centroids
from hybridreg.pair import Pair
from hybridreg.resolution import comparable, default_voxel
from hybridreg.runtime.side_by_side import side_by_side

_MANY = 900_000  # points above which a cloud is thinned; by hand
# Cells kept along the edge of a voxel: surfaces are fitted, and free space is tested, at no less than half a voxel.
_CELLS = 4
# Clouds of very different extent have a voxel each, as in `hybridreg.resolution`.
_CELLS_ALONG_REACH = 60.0
# Occupied cells per point above which a random sample fills a volume.
_SPREAD = 0.35


def thinned(pair: Pair, voxel: float | None) -> Pair:
    """The pair, each of its clouds of more than 900,000 points replaced by the centroids of its fine cells.

    Parameters
    ----------
    voxel : float or None
        Metres, of the grid that follows; None as `default_voxel`. Cells are a quarter as wide, or up to as wide where
        the points fill a volume, which no surface does.
    """
    source, target = side_by_side(lambda cloud: _thinned(cloud, pair, voxel), pair.source, pair.target)
    if source is pair.source and target is pair.target:
        return pair
    return pair.with_clouds(source, target)


def _thinned(cloud: PointCloud, pair: Pair, voxel: float | None) -> PointCloud:
    if len(cloud) <= _MANY:
        return cloud
    if voxel is None:
        alike = comparable(pair.source, pair.target)
        voxel = default_voxel(pair.source, pair.target) if alike else reach(cloud.radii) / _CELLS_ALONG_REACH
    return cloud.once(("thinned", voxel), lambda: _of_cells(cloud, voxel))


def _of_cells(cloud: PointCloud, voxel: float) -> PointCloud:
    cells = voxel_cells(cloud.points, _cell(cloud, voxel))
    cells.centroids.setflags(write=False)
    said = cloud.said
    if said is not None and said.of_point is not None:
        said = said._replace(of_point=said.of_point[cells.first])
    return replace(cloud, points=cells.centroids, said=said, kept=None if cloud.kept is None else {})


def _cell(cloud: PointCloud, voxel: float) -> float:
    # A million points on surfaces fall into far fewer cells.
    drawn, cell = some(cloud.points), voxel / _CELLS
    while 2.0 * cell <= voxel and len(voxel_centroids(drawn, cell)) > _SPREAD * len(drawn):
        cell *= 2.0
    return cell
