# SPDX-License-Identifier: MIT
"""How closely the points of one cloud lie on the surfaces of the other, compared with the sensors' noise.

Along a corridor many poses bring walls onto walls within a surface's tolerance. At the right one the points lie on them
to a centimetre or two, those on door frames and kerbs too; at a wrong one they are some centimetres off. That takes
surfaces as fine as the clouds show them; normals are estimated where a pose asks for them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.cloud import PointCloud
from hybridreg.geometry import se3
from hybridreg.geometry.extent import bounds, reach
from hybridreg.geometry.point_to_plane import descend
from hybridreg.pair import Pair
from hybridreg.runtime.side_by_side import side_by_side

Array = NDArray[np.float64]

# Metres, extent of a cloud from which the lengths below hold; for smaller ones, scanned from nearer, they shrink in
# proportion; by hand.
_FROM = 5.0
# Metres, grid of the surfaces; by hand.
_CELL = 0.02
# Metres, standard deviation of a range: that of common LiDARs.
_NOISE = 0.03
# Metres, farthest partner of a point; by hand.
_NEAR = 0.5
# Cells of the grid along an axis, at most: what its integer keys hold.
_MOST_CELLS = 2**20
# Neighbours that a normal is estimated from; by hand.
_NEIGHBOURS = 15
# Points of a cloud that make surfaces, at most: for speed.
_MOST = 100_000
# Points that are compared, at most: for speed.
_ASKED = 1_500
# Farthest partners of the settling steps, shares of `_NEAR`; by hand.
_REACHES = (1.0, 0.7, 0.5, 0.3, 0.2)
# Width of the weights per farthest partner, at least the noise; by hand.
_TRUST = 0.25
# Points that settle: for speed.
_SETTLING = 600
# Share of the near points that lie on no common surface: on what moved, or was seen from one side only; by hand.
_ANYWHERE = 0.2
# Points added to every count: so few close points are a coincidence; by hand.
_FEW = 20.0


@dataclass(frozen=True, eq=False)
class Surfaces:
    """One cloud at the finest grid that it supports.

    Attributes
    ----------
    points : (n, 3) float64, metres
    tree : KD-tree of the points
    asked : (m, 3) float64
        Points that are compared.
    scale : float
        What the lengths above are multiplied by; 1 outdoors.
    """

    points: Array
    tree: cKDTree
    asked: Array
    scale: float
    _normals: Array
    _known: NDArray[np.bool_]

    @property
    def noise(self) -> float:
        """Standard deviation of a range, metres."""
        return _NOISE * self.scale

    @property
    def far(self) -> float:
        """Farthest partner of a point, metres."""
        return _NEAR * self.scale

    def facing(self, rows: NDArray[np.int64]) -> Array:
        """Normals (k, 3) of some points, estimated when they are first asked for: those of most points never are."""
        new = np.unique(rows[~self._known[rows]])
        if len(new):
            near = self.points[self.tree.query(self.points[new], k=min(_NEIGHBOURS, len(self.points)))[1]]
            centred = near - near.mean(axis=1, keepdims=True)
            self._normals[new] = np.linalg.eigh(np.swapaxes(centred, 1, 2) @ centred)[1][:, :, 0]
            self._known[new] = True
        return self._normals[rows]

    def across(self, points: Array) -> tuple[NDArray[np.bool_], Array]:
        """Which of some points (n, 3) have a partner, and their signed distances (k,) to the partners' planes."""
        distance, match = self.tree.query(points, distance_upper_bound=self.far)
        near = np.isfinite(distance)
        row = match[near]
        return near, np.einsum("ni,ni->n", points[near] - self.points[row], self.facing(row))

    def near(self, points: Array) -> NDArray[np.bool_]:
        """Which of some points (n, 3) have a partner."""
        return np.isfinite(self.tree.query(points, distance_upper_bound=self.far)[0])


class FineSurfaces(NamedTuple):
    """Both clouds of a pair."""

    source: Surfaces
    target: Surfaces

    @classmethod
    def of(cls, pair: Pair) -> FineSurfaces:
        """Made side by side: most of it is sorting and trees."""
        clouds = (pair.source, pair.target)
        scale = min(1.0, *(reach(cloud.radii) / _FROM for cloud in clouds)) or 1.0
        return cls(*side_by_side(lambda cloud: _surfaces(cloud, scale), *clouds))


def closeness(fine: FineSurfaces, T_target_source: Array) -> float:
    """Nats per point by which the pose explains the distances to the surfaces better than chance does.

    The log-likelihood of points with a partner near by under a mixture (on the surface but for noise, or anywhere near)
    over that of points anywhere near; the greater of both directions, as sparse rings make poor surfaces.

    Parameters
    ----------
    T_target_source : (4, 4)
        A pose, or one with a size.
    """
    source, target = fine
    back: Array = np.linalg.inv(T_target_source).astype(np.float64)  # of a pose with a size too
    return max(
        one_way(source.asked, target, T_target_source),
        one_way(target.asked, source, back),
    )


def settle_closely(fine: FineSurfaces, T_target_source: Array) -> Array:
    """Poses (..., 4, 4) near by at which the source's points lie best on the target's fine surfaces."""
    source, target = fine
    steps = [(part * target.far, max(target.noise, _TRUST * part * target.far)) for part in _REACHES]
    return descend(T_target_source, source.asked[:_SETTLING], target, steps)


def _surfaces(cloud: PointCloud, scale: float) -> Surfaces:
    from hybridreg.geometry.voxel_cells import voxel_centroids

    rng = np.random.default_rng(0)
    points = cloud.points
    if len(points) > _MOST:
        points = points[np.sort(rng.permutation(len(points))[:_MOST])]
    low, high = bounds(points)
    points = voxel_centroids(points, max(_CELL * scale, float((high - low).max()) / _MOST_CELLS))
    return Surfaces(
        points=points,
        tree=cKDTree(points, balanced_tree=False, compact_nodes=False),
        asked=points[rng.permutation(len(points))[:_ASKED]],
        scale=scale,
        _normals=np.zeros_like(points),
        _known=np.zeros(len(points), dtype=bool),
    )


def one_way(asked: Array, other: Surfaces, T_other_asked: Array) -> float:
    """The same of points (m, 3) of one cloud on the surfaces of the other."""
    far, noise = other.far, other.noise
    _, across = other.across(se3.apply(T_other_asked, asked))
    # Of distances up to the farthest: a half-normal one of the noise, or any.
    on_it = np.sqrt(2.0 / np.pi) / noise * np.exp(-0.5 * (across / noise) ** 2)
    nats = np.log((1.0 - _ANYWHERE) * on_it * far + _ANYWHERE)
    return float(nats.sum() / (len(nats) + _FEW))
