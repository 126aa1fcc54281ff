# SPDX-License-Identifier: MIT
"""A coarse motion along the ground improved until both reliefs correlate best."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.geometry.ground_relief import Relief, looked_up, nats
from hybridreg.geometry.stencil import NEIGHBOURS

Array = NDArray[np.float64]

# Lengths of the step, each half of the one before; by hand.
_HALVINGS = 5
# Moves at each length; by hand.
_TIMES = 2
# Cells that are compared: for speed.
_MOST_PLACES = 1_000
# Rounds in which one ground is fitted to the other; by hand.
_ROUNDS = 4
# Gap from which a cell counts less, cells; by hand.
_SMOOTH = 0.08
# Fewest cells; by hand.
_FEWEST = 20


def climb(source: Relief, target: Relief, planar: list[Array], step: float) -> list[Array]:
    """Each motion (4, 4), moved by ever shorter steps (the first in metres) to the best correlation of the reliefs."""
    every = -(-len(source.places) // _MOST_PLACES)
    places = se3.apply(source.T_level_cloud, source.places[::every])[:, :2]
    known = ~np.isnan(target.grid)
    maps = np.where(known, target.grid, 0.0), known.astype(np.float64)
    return [_climbed(places, source.heights[::every], target, maps, T, step) for T in planar]


def _climbed(
    places: Array, heights: Array, target: Relief, maps: tuple[Array, Array], T: Array, step: float
) -> Array:
    laid = places @ T[:2, :2].T + T[:2, 3]
    common = laid[~np.isnan(looked_up(target.grid, laid, target.cell))]
    # Turned about the middle of what both show, a pose does not slide.
    middle = common.mean(axis=0) if len(common) else laid.mean(axis=0)
    arm = float(np.sqrt(np.mean(np.sum((common - middle) ** 2, axis=1)))) if len(common) else step
    x, y, yaw = np.zeros(3)
    for size in np.repeat(step * 0.5 ** np.arange(_HALVINGS), _TIMES):
        tried = np.array([x, y, yaw]) + NEIGHBOURS * [size, size, size / max(arm, step)]  # (27, 3)
        moved = _turned(laid - middle, tried[:, 2]) + middle + tried[:, None, :2]
        x, y, yaw = tried[np.argmax(_alike(heights, _between(*maps, moved / target.cell)))]
    turn = se3.yaw(float(np.degrees(yaw)))
    turn[:2, 3] = middle - turn[:2, :2] @ middle + [x, y]
    return turn @ T


def _turned(places: Array, yaws: Array) -> Array:
    # Places (n, 2) turned by each yaw (k,) in radians: (k, n, 2).
    c, s = np.cos(yaws)[:, None], np.sin(yaws)[:, None]
    x, y = places.T
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _between(heights: Array, known: Array, places: Array) -> Array:
    # Heights between the middles of the four cells around places (..., 2), in cells, as far as these are known.
    n = len(heights)
    heights, known = heights.ravel(), known.ravel()
    at = np.clip(places + 0.5 * n - 0.5, 0.0, n - 2.0)
    low = at.astype(np.int64)
    x, y = np.moveaxis(at - low, -1, 0)
    first = low[..., 0] * n + low[..., 1]
    total, weight = np.zeros(first.shape), np.zeros(first.shape)
    for step, part in ((0, (1 - x) * (1 - y)), (1, (1 - x) * y), (n, x * (1 - y)), (n + 1, x * y)):
        total += part * heights[first + step]
        weight += part * known[first + step]
    return np.where(weight > 0.5, total / np.maximum(weight, 0.5), np.nan)


def _alike(heights: Array, there: Array) -> Array:
    # Information (k,) of heights (n,) beside those of the target (k, n), NaN where unknown.
    known = ~np.isnan(there)
    there = np.where(known, there, 0.0)
    own, other = known @ heights**2, np.sum(there**2, axis=1)
    loud = np.sqrt(np.maximum(own * other, np.finfo(float).tiny))
    return nats(np.count_nonzero(known, axis=1), there @ heights / loud)


def laid(source: Relief, target: Relief, M: Array) -> Array:
    """A motion along the ground, leant and lifted so that the source's ground lies on the target's."""
    moved = se3.apply(M @ source.T_level_cloud, source.places)
    gap = looked_up(target.floor, moved[:, :2], target.cell) - moved[:, 2]
    known = ~np.isnan(gap)
    if np.count_nonzero(known) < _FEWEST:
        return M
    A = np.column_stack([np.ones(known.sum()), moved[known, :2]])
    gap, weight = gap[known], np.ones(known.sum())
    for _ in range(_ROUNDS):
        lift, by_x, by_y = np.linalg.lstsq(A * weight[:, None], gap * weight, rcond=None)[0]
        weight = 1.0 / np.sqrt(1.0 + ((gap - A @ [lift, by_x, by_y]) / (_SMOOTH * target.cell)) ** 2)
    return se3.from_rt(se3.rotation_about(np.array([by_y, -by_x, 0.0])), np.array([0.0, 0.0, lift])) @ M
