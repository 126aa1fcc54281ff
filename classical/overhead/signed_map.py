# SPDX-License-Identifier: MIT
"""Columns as a signed map: positive where occupied, negative where free."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.overhead.overhead_columns import Columns, FromAbove

Floats = NDArray[np.float32]

# Weight of a free column, against 1 of an occupied one. Free space must not decide alone: rays cross hedges and pass
# over kerbs; by hand.
_FREE = np.float32(-0.15)
# Standard deviation of the blur, cells: half a cell of shift and half a step of yaw must not lose a wall; by hand.
_BLUR = 0.7


def signed(view: FromAbove, turn: complex, n: int, cell: float) -> Floats:
    """Map (layers, n, n) of a view turned by a complex number of length one; it wraps round at n cells.

    The place (0, 0) is the lower corner of the cell [0, 0]; `cell` is its edge in metres.
    """
    evidence = np.zeros(view.n_layers * n * n, dtype=np.float32)
    evidence[_cells(view.free, turn, n, cell)] = _FREE
    evidence[_cells(view.filled, turn, n, cell)] = 1.0
    return evidence.reshape(view.n_layers, n, n)


def blurred(evidence: Floats) -> Floats:
    """The map with occupied cells spread to those around, which then are less free."""
    from scipy.ndimage import gaussian_filter

    filled = gaussian_filter((evidence > 0).astype(np.float32), (0.0, _BLUR, _BLUR), mode="wrap")
    filled = np.minimum(filled * np.float32(2.0 * np.pi * _BLUR**2), 1.0)
    spread: Floats = filled + np.minimum(evidence, 0.0) * (1.0 - filled)
    return spread


def _cells(columns: Columns, turn: complex, n: int, cell: float) -> NDArray[np.int64]:
    turned = columns.places * (turn / cell)
    i, j = np.floor(turned.real).astype(np.int64) % n, np.floor(turned.imag).astype(np.int64) % n
    return (columns.layer * n + i) * n + j
