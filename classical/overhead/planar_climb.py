# SPDX-License-Identifier: MIT
"""A coarse pose on the ground improved on a finer map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.overhead.overhead_columns import FromAbove
from hybridreg.classical.overhead.signed_map import blurred, signed
from hybridreg.classical.overhead.sweep import Planar
from hybridreg.geometry.stencil import NEIGHBOURS

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

# Moves, each half as long as the one before; by hand.
_MOVES = 3
# Columns that are compared: for speed.
_MOST_COLUMNS = 800
# Poses nearer than both are one: cells; by hand.
_SAME_CELLS = 2.0
# Degrees; by hand.
_SAME_DEG = 3.0


def climb(
    source: FromAbove, target: FromAbove, start: Planar, *, cell: float, step_deg: float, step: float
) -> Planar:
    """Better poses near each of `start`, in the same order and with the same scores, without duplicates.

    The coarse map ranks poses better than the fine one, which is more sensitive to levelling and to unequal sampling;
    so the fine one only improves the position.

    Parameters
    ----------
    cell : float
        Edge of the finer map's cell, metres.
    step_deg, step : float
        Of the first move: degrees of yaw, metres of shift.
    """
    reach = max(float(np.abs(target.filled.places).max(initial=0.0)), cell)
    n = 2 * int(np.ceil(reach / cell)) + 4
    table = blurred(signed(target, 1.0, n, cell))
    every = max(1, -(-len(source.filled.layer) // _MOST_COLUMNS))
    places, layer = source.filled.places[::every], source.filled.layer[::every]
    yaw, shift = start.yaw, start.shift
    rows = np.arange(len(yaw))
    for move in range(_MOVES):
        size = 0.5**move
        yaws = yaw[:, None] + size * np.radians(step_deg) * NEIGHBOURS[:, 0]  # (k, 27)
        shifts = shift[:, None] + size * step * (NEIGHBOURS[:, 1] + 1j * NEIGHBOURS[:, 2])
        scores = _scores(table, places / cell, layer, yaws, shifts / cell)
        best = np.argmax(scores, axis=1)
        yaw, shift = yaws[rows, best], shifts[rows, best]
    return _distinct(Planar(yaw, shift, start.score), _SAME_CELLS * cell)


def _distinct(found: Planar, apart: float) -> Planar:
    # Without those that came out beside an earlier one.
    kept: list[int] = []
    for one in range(len(found.score)):
        turn = np.angle(np.exp(1j * (found.yaw[kept] - found.yaw[one])))
        near = (np.abs(turn) < np.radians(_SAME_DEG)) & (np.abs(found.shift[kept] - found.shift[one]) < apart)
        if not near.any():
            kept.append(one)
    return Planar(found.yaw[kept], found.shift[kept], found.score[kept])


def _scores(
    table: Floats,
    places: NDArray[np.complex128],
    layer: NDArray[np.int64],
    yaws: Array,
    shifts: NDArray[np.complex128],
) -> Array:
    # Mean evidence of the target at the source's columns, (k, 27). Beyond the map nothing is known.
    n = table.shape[1]
    half = n // 2
    turned = np.exp(1j * yaws)[..., None] * places + shifts[..., None]
    i, j = np.floor(turned.real).astype(np.int32), np.floor(turned.imag).astype(np.int32)
    known = np.maximum(np.abs(i), np.abs(j)) < half - 1
    flat = (layer * n + i % n) * n + j % n
    evidence = np.where(known, table.ravel()[flat], np.float32(0.0))
    scores: Array = evidence.mean(axis=-1, dtype=np.float64)
    return scores
