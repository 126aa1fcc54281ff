# SPDX-License-Identifier: MIT
"""Ground relief: small rises and dips of nearly flat ground tell places apart where nothing stands on it.

Ships and aircraft without satellite navigation locate themselves by the relief under them (terrain contour matching).
A field, a lawn or a road has relief of a few centimetres, metres wide: less than a surface's tolerance, but the same
for every sensor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.geometry.ground import Ground

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_AROUND = 6  # cells: radius of the surroundings that a height is compared with; by hand
_ROUGH = 0.1  # cells: roughness of a cell of ground, at most; by hand
_KERB = 0.3  # cells: its height over the surroundings, at most (a kerb, the foot of a wall); by hand
_MOST = 0.08  # cells: heights are clipped at this; by hand
# Distance of ground from the plane under the sensor, at most; by hand.
_BAND = 1.2  # cells
_SLOPE = 0.06  # and this much more for each metre away from the sensor
_TALL = 4.0  # cells above that in which objects on the ground are looked for; by hand
# Square cells added to the spread of the cells around, so that a single row of cells gives no slope across it.
_FIRM = 1.0
_POINTS = 3  # that a cell needs for a height; by hand
_REACH = 120  # cells to each side of the sensor; by hand
# Grounds that are tilted more against each other, or lie farther apart, are not the same; by hand.
_LEAN = float(np.cos(np.radians(20.0)))  # cosine of the angle
_APART = 4.0  # cells
# Fewer common cells say nothing.
_FEWEST = 20
_CERTAIN = 0.999
# Standard deviations of most heights beyond which one belongs to a mound, a dip or a kerb; by hand. Relief of fields
# and roads has hardly any.
_LOUD = 4.0
_OF_NORMAL = 1.4826  # standard deviations in a median distance from the middle, of normal numbers
# Information from which a relief tells one place from another, nats: a search over all yaws and shifts finds as much by
# chance where the ground is bare.
TELLS = 30.0


class Alike(NamedTuple):
    """How similar two reliefs are under one pose.

    cells : number of cells that both clouds show
    correlation : of their heights, in [-1, 1]; 0 where the cells are few
    """

    cells: float
    correlation: float

    @property
    def information(self) -> float:
        """Evidence for the pose in nats: the log-likelihood ratio of heights this similar to unrelated ones; negative
        where they are opposed."""
        return float(nats(self.cells, self.correlation))


def nats(cells: Array | float, correlation: Array | float) -> Array:
    """Mutual information of this many pairs of normal numbers with this correlation, with its sign."""
    r = np.clip(correlation, -_CERTAIN, _CERTAIN)
    told: Array = -0.5 * np.sign(r) * cells * np.log1p(-r * r)
    return told


@dataclass(frozen=True, eq=False, kw_only=True)
class Relief:
    """Heights of one cloud's ground, minus those around.

    Attributes
    ----------
    places : (k, 3) float64
        Centres of the cells whose ground the cloud shows, in its frame.
    heights : (k,) float64, metres
    grid, floor : (n, n) float64
        The same heights, and those over the plane under the sensor, as maps; NaN where the ground is not known.
    T_level_cloud : (4, 4) float64
        Maps that plane to z = 0 and the sensor above the middle of the maps.
    cell : float, metres
    """

    places: Array
    heights: Array
    grid: Array
    floor: Array
    T_level_cloud: Array
    cell: float

    @classmethod
    def of(cls, points: Array, viewpoint: Array, ground: Ground, cell: float) -> Relief:
        """Relief of a cloud (n, 3) seen from around `viewpoint` (3,), over `ground`."""
        centre = ground.levelling @ viewpoint
        T = se3.from_rt(ground.levelling, -np.array([centre[0], centre[1], ground.height]))
        level = se3.apply(T, points)
        height, top, known = _columns(level, cell)
        for _ in range(2):
            around = _around(height, known)
            known &= np.abs(height - around) < _KERB * cell
        known &= ~_beside(top - around > _KERB * cell)
        above = np.clip(height - _around(height, known), -_MOST * cell, _MOST * cell)
        i, j = np.nonzero(known)
        level = np.column_stack([cell * (i + 0.5 - _REACH), cell * (j + 0.5 - _REACH), height[i, j]])
        return cls(
            places=se3.apply(se3.inverse(T), level),
            heights=above[i, j],
            grid=np.where(known, above, np.nan),
            floor=np.where(known, height, np.nan),
            T_level_cloud=T,
            cell=cell,
        )

    def at(self, places: Array) -> Array:
        """Heights (n,) at places (n, 3) of the cloud's frame; NaN where the ground is not known, or is somewhere
        else."""
        level = se3.apply(self.T_level_cloud, places)
        height = looked_up(self.grid, level[:, :2], self.cell)
        far = np.abs(level[:, 2]) > _APART * self.cell + _SLOPE * np.hypot(level[:, 0], level[:, 1])
        return np.where(far, np.nan, height)


def looked_up(grid: Array, xy: Array, cell: float) -> Array:
    """Values (...) of a map at places (..., 2) of its level frame; NaN beyond it."""
    cells = np.floor(xy / cell).astype(np.int64) + _REACH
    inside: Mask = np.asarray(((cells >= 0) & (cells < len(grid))).all(axis=-1))
    i, j = np.moveaxis(np.where(inside[..., None], cells, 0), -1, 0)
    return np.where(inside, grid[i, j], np.nan)


def alike(source: Relief | None, target: Relief | None, T_target_source: Array, every: int = 1) -> Alike:
    """How similar the ground is under a pose (4, 4), from one cell in `every`; nothing is known where a cloud shows no
    ground."""
    if source is None or target is None:
        return Alike(0.0, 0.0)
    ups = [r.T_level_cloud[2, :3] for r in (source, target)]
    if float(ups[1] @ T_target_source[:3, :3] @ ups[0]) < _LEAN:
        return Alike(0.0, 0.0)
    forth = target.at(se3.apply(T_target_source, source.places[::every]))
    back = source.at(se3.apply(se3.inverse(T_target_source), target.places[::every]))
    a = np.concatenate([source.heights[::every], back])
    b = np.concatenate([forth, target.heights[::every]])
    both = ~np.isnan(a + b)
    a, b = a[both], b[both]
    told = _correlated(a, b, every)
    if told.information < TELLS:
        return told
    # Of one mound on flat ground each cell around it would count as evidence.
    quiet = (np.abs(a) < _LOUD * _deviation(a)) & (np.abs(b) < _LOUD * _deviation(b))
    return min(told, _correlated(a[quiet], b[quiet], every), key=lambda one: one.information)


def _correlated(a: Array, b: Array, every: int) -> Alike:
    # Each place was looked up from both sides, so that the swapped pair gives the same.
    cells = every * len(a) / 2.0
    if cells < _FEWEST:
        return Alike(cells, 0.0)
    loud = float(np.sqrt((a @ a) * (b @ b)))
    return Alike(cells, float(a @ b) / loud if loud > 0.0 else 0.0)


def _deviation(heights: Array) -> float:
    # Standard deviation of most heights, whatever a few are.
    return _OF_NORMAL * float(np.median(np.abs(heights)))


def _columns(level: Array, cell: float) -> tuple[Array, Array, Mask]:
    # For each cell (2 * _REACH, 2 * _REACH): mean height of possible ground points, the highest point standing on it,
    # and whether its ground is even.
    n = 2 * _REACH
    i, j = np.floor(level[:, :2] / cell).astype(np.int64).T + _REACH
    band = _BAND * cell + _SLOPE * np.hypot(level[:, 0], level[:, 1])
    kept = (
        (i >= 0) & (i < n) & (j >= 0) & (j < n) & (level[:, 2] > -band) & (level[:, 2] < band + _TALL * cell)
    )
    key, z, low = (i * n + j)[kept], level[kept, 2], (level[:, 2] < band)[kept]
    top = np.full(n * n, -np.inf)
    np.maximum.at(top, key, z)
    key, z = key[low], z[low]
    count, total, square = (np.bincount(key, w, minlength=n * n) for w in (None, z, z * z))
    mean = total / np.maximum(count, 1)
    rough = square / np.maximum(count, 1) - mean * mean
    known = (count >= _POINTS) & (rough < (_ROUGH * cell) ** 2)
    return np.where(known, mean, 0.0).reshape(n, n), top.reshape(n, n), known.reshape(n, n)


def _beside(things: Mask) -> Mask:
    # Cells with something on them and those around: a few of its points would raise the ground at its foot.
    from scipy.ndimage import binary_dilation

    beside: Mask = binary_dilation(things, np.ones((3, 3), dtype=bool))
    return beside


def _around(height: Array, known: Mask) -> Array:
    # Height at each cell of the plane through the known cells around it, 0 where there are none: a mean would take a
    # slope for a hollow where the known cells lie to one side.
    around = np.zeros_like(height)
    if known.any():
        # Elsewhere there is nothing to compute, and a sensor seldom shows ground all over the map.
        part = tuple(_reached(np.asarray(known.any(axis=1 - axis))) for axis in (0, 1))
        around[part] = _planes_around(height[part], known[part])
    return around


def _reached(known: Mask) -> slice:
    rows = np.flatnonzero(known)
    return slice(max(int(rows[0]) - _AROUND, 0), int(rows[-1]) + _AROUND + 1)


def _planes_around(height: Array, known: Mask) -> Array:
    from scipy.ndimage import uniform_filter

    x, y = np.meshgrid(*[np.arange(n) - 0.5 * n for n in height.shape], indexing="ij")

    def box(values: Array) -> Array:
        found: Array = uniform_filter(np.where(known, values, 0.0), 2 * _AROUND + 1, mode="constant")
        return found

    share = np.maximum(box(np.ones_like(height)), 1e-9)

    def mean(values: Array) -> Array:
        return box(values) / share

    x_, y_, z_ = mean(x), mean(y), mean(height)
    xx, xy, yy = mean(x * x) - x_ * x_ + _FIRM, mean(x * y) - x_ * y_, mean(y * y) - y_ * y_ + _FIRM
    xz, yz = mean(x * height) - x_ * z_, mean(y * height) - y_ * z_
    det = xx * yy - xy * xy
    by_x, by_y = (yy * xz - xy * yz) / det, (xx * yz - xy * xz) / det
    around: Array = z_ + by_x * (x - x_) + by_y * (y - y_)
    return around
