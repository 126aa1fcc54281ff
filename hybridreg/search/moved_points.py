# SPDX-License-Identifier: MIT
"""How many of the source's points under a pose coincide with the target's, there and after every shift and turn."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.views import Views
from hybridreg.geometry import se3
from hybridreg.geometry.main_axes import faced
from hybridreg.search.occupied_cells import OccupiedCells

Array = NDArray[np.float64]

# Points that coincide by chance, added to every count; by hand.
CHANCE = 10.0
# Fewest points that identify a place; by hand.
_FEWEST = 20


class MovedPoints:
    """The source's points under a pose and the target's, told apart by the main axis that their surfaces face. Two
    coincide in one cell of a grid.

    Parameters
    ----------
    T_target_source : (4, 4)
    axes : (3, 3)
        Rows: the directions that surfaces face, in the target's frame, the commonest first.
    cell : float
        Edge of a cell, metres.
    most : int
        Points of the source that face the commonest axis, and others, at most: for speed.
    wide : bool
        A point fills the eight cells around it, not the one that it lies in: for cells that are finer than the clouds.

    Attributes
    ----------
    things, others : (n, 3) and (m, 3), the source's points and the target's
    axis, other_axis : (n,) and (m,), the row of `axes` that each faces
    """

    def __init__(
        self, views: Views, T_target_source: Array, axes: Array, cell: float, most: int, *, wide: bool = False
    ) -> None:
        source, target = views.source, views.target
        facing = faced(source.normals[source.settling] @ T_target_source[:3, :3].T, axes)
        kept = np.concatenate([np.flatnonzero(facing > 0)[:most], np.flatnonzero(facing == 0)[:most]])
        self.axis, self.axes, self.cell, self._wide = facing[kept], axes, cell, wide
        self.things = se3.apply(T_target_source, source.points[source.settling[kept]])
        self.others, self.other_axis = target.points, faced(target.normals, axes)

    @property
    def tell_nothing(self) -> bool:
        """Whether too few points of either cloud face another than the commonest axis."""
        return any(int((rows > 0).sum()) < _FEWEST for rows in (self.axis, self.other_axis))

    @property
    def upright(self) -> Array:
        """The axes as a frame in which the commonest is the third."""
        return np.vstack([self.axes[1:], self.axes[:1]])

    def share(
        self,
        kinds: Sequence[int],
        frame: Array,
        middle: Array,
        turns: Sequence[Array],
        reach: tuple[int, int],
    ) -> Array:
        """Of the points that coincide at the pose, the share that does after each turn about the middle and shift
        along the first two axes of `frame`: the least of any kind, (turns, 2 rows + 1, 2 columns + 1).
        """
        arms = self.things - middle
        farthest = np.linalg.norm(arms, axis=1).max() + 2 * max(reach) * self.cell
        share = np.full((len(turns), 2 * reach[0] + 1, 2 * reach[1] + 1), np.inf)
        for kind in kinds:
            held = (self.others[self.other_axis == kind] - middle) @ frame.T
            held = held[np.abs(held).max(axis=1) < farthest]
            if len(held) == 0:
                continue
            cells, own = OccupiedCells(self._filling(held), self.cell), arms[self.axis == kind]
            met = CHANCE + np.stack([cells.met(own @ turn.T @ frame.T, reach) for turn in turns])
            np.minimum(share, met / met[:, reach[0], reach[1]].max(), out=share)
        # Infinite where the other cloud has nothing near.
        return np.where(np.isfinite(share), share, 0.0)

    def _filling(self, points: Array) -> Array:
        if not self._wide:
            return points
        corners = 0.5 * self.cell * np.array(list(product((-1.0, 1.0), repeat=3)))
        return (points[:, None] + corners).reshape(-1, 3)


def peaks(share: Array, sizes: int | tuple[int, ...], least: float) -> list[tuple[int, ...]]:
    """Where no less coincides than in the window of those sizes around, and `least` at the least, the fullest first."""
    from scipy.ndimage import maximum_filter

    peak = np.argwhere((share == maximum_filter(share, sizes, mode="constant")) & (share >= least))
    order = np.argsort(-share[tuple(peak.T)], kind="stable")
    return [tuple(row) for row in peak[order].tolist()]
