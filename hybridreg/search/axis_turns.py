# SPDX-License-Identifier: MIT
"""Where walls, floors and faces meet after a turn that maps three orthogonal directions onto one another."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from hybridreg.evidence.views import View, Views
from hybridreg.geometry import se3

Array = NDArray[np.float64]

# Cells along an edge of the grid: 32 to 64 find as many on 41 hard pairs with even seeds.
_CELLS = 40
# Share of the grid that the larger cloud may take, so that no shift wraps around.
_FILLED = 0.49
# Share of the points beyond which a cloud's ends are left out: by hand.
_ENDS = 0.005


def _turns() -> Array:
    signed = (
        np.eye(3)[list(order)] * np.array(sign)
        for order in permutations(range(3))
        for sign in product((1, -1), repeat=3)
    )
    return np.array([turn for turn in signed if np.linalg.det(turn) > 0.0])


# The 24 rotations of a cube, the identity among them, (24, 3, 3).
TURNS = _turns()


def poses(views: Views, axes: Array, rotations: Array) -> Array:
    """For each rotation the pose at which most surfaces meet that face the same way, the fullest first.

    Both clouds are drawn into grids, a channel for each side of the three axes, and correlated by FFT.

    Parameters
    ----------
    axes : (3, 3)
        Rows: the directions, in the target's frame, by which surfaces are told apart.
    rotations : (k, 3, 3)
        From the source's frame to the target's.

    Returns
    -------
    (k, 4, 4)
    """
    source, target = views.source, views.target
    other = _Sides(target, axes)
    drawn = [_Sides(source, axes @ R) for R in rotations]
    cell = max(max(one.extent for one in [other, *drawn]) / (_FILLED * _CELLS), views.spacing)
    there = fft.rfftn(other.grid(cell), axes=(1, 2, 3))
    found = []
    for one, R in zip(drawn, rotations, strict=True):
        spectrum = (there * fft.rfftn(one.grid(cell), axes=(1, 2, 3)).conj()).sum(axis=0)
        met = fft.irfftn(spectrum, s=(_CELLS,) * 3)
        peak = np.unravel_index(int(np.argmax(met)), met.shape)
        cells = (np.array(peak) + _CELLS // 2) % _CELLS - _CELLS // 2
        shift = cells * cell + other.low - one.low
        found.append((float(met[peak]), se3.from_rt(R, axes.T @ shift)))
    return np.array([T for _, T in sorted(found, key=lambda one: -one[0])]).reshape(-1, 4, 4)


class _Sides:
    # Points of a cloud along three axes (rows, in the cloud's frame), and which side of an axis each faces.
    def __init__(self, view: View, axes: Array) -> None:
        rows = view.settling
        facing = view.normals[rows] @ axes.T
        axis = np.abs(facing).argmax(axis=1)
        self.side = 2 * axis + (facing[np.arange(len(rows)), axis] > 0.0)
        self.along = view.points[rows] @ axes.T
        self.low, self.high = np.quantile(self.along, [_ENDS, 1.0 - _ENDS], axis=0)
        self.extent = float((self.high - self.low).max())

    def grid(self, cell: float) -> NDArray[np.float32]:
        held = np.zeros((6, _CELLS, _CELLS, _CELLS), dtype=np.float32)
        inside = ((self.along >= self.low) & (self.along <= self.high)).all(axis=1)
        x, y, z = np.floor((self.along[inside] - self.low) / cell).astype(np.int64).T
        held[self.side[inside], x, y, z] = 1.0
        return held
