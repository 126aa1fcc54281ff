# SPDX-License-Identifier: MIT
"""The extent of a cloud. Column by column: numpy reduces (N, 3) along its long axis twenty times more slowly."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

# Quantile of the points' distances from the cloud's middle that is its extent: stray returns lie anywhere.
_MOST = 0.9
# Times the extent beyond which a point lies alone; by hand.
_LONE = 1e3
# Points that give a median to a few percent.
_ASKED = 500
# Points that give quantiles of a cloud to a thousandth.
_ENOUGH = 1_000_000


def bounds(points: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Lower and upper corner (d,) of the box around `points` (N, d)."""
    columns = points.T
    return np.array([column.min() for column in columns]), np.array([column.max() for column in columns])


def sample(points: NDArray[Any], n: int) -> NDArray[Any]:
    """At most `n` of the points (N, ...), drawn at random, always the same ones, in their order.

    Every k-th point would be a single ring of a cloud whose rings take turns in the file.
    """
    if len(points) <= n:
        return points
    return points[np.sort(np.random.default_rng(0).choice(len(points), n, replace=False))]


def apart(points: Array) -> float:
    """Median distance of points (N, 3), at least two, to the nearest other, metres: of 500 of them."""
    asked = points[:: max(1, len(points) // _ASKED)]
    return float(np.median(cKDTree(points).query(asked, k=2)[0][:, 1]))


def some(points: Array) -> Array:
    """The points (N, 3) themselves, or a million drawn at random where there are more, always the same."""
    if len(points) <= _ENOUGH:
        return points
    return points[np.random.default_rng(0).integers(0, len(points), _ENOUGH)]


def radii(points: Array) -> Array:
    """Distances of `points` (N, 3) from the point of their medians, the shortest first, metres: (N,), of `some`."""
    columns = np.ascontiguousarray(some(points).T)
    # Not in place: of points that lie column by column these are the points themselves.
    columns = columns - np.median(columns, axis=1)[:, None]
    return np.sort(np.sqrt(np.einsum("in,in->n", columns, columns)))


def share_within(radii: Array, share: float) -> float:
    """Radius within which this share of the points lies, from their `radii`."""
    return float(radii[round(share * (len(radii) - 1))])


def reach(radii: Array) -> float:
    """Extent of a cloud, metres, from its `radii`."""
    return share_within(radii, _MOST)


def lone(points: Array) -> str:
    """In words, how many of `points` (N, 3) lie a thousand times as far away as the extent; nothing where none does."""
    middle = np.median(points, axis=0)
    away = np.sqrt(sum((points[:, k] - middle[k]) ** 2 for k in range(3)))
    count = int((away > _LONE * np.quantile(away, _MOST)).sum())
    return f"{count} of {len(points)} points lie up to {away.max():.3g} m from the others" if count else ""
