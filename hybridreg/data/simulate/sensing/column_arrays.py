# SPDX-License-Identifier: MIT
"""Rows of three numbers, stored column by column: numpy adds, scales and gathers them several times as fast.

An array (n,3) in Fortran order looks and counts like any other; these are the operations that would lose the order.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def stack(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> NDArray[np.float32]:
    """Rows (n,3) of three arrays of one size, whatever their shape."""
    rows = np.empty((3, x.size), np.float32)
    for column, values in zip(rows, (x, y, z), strict=True):
        column[:] = values.reshape(-1)
    return rows.T


def pick(rows: np.ndarray, index: np.ndarray) -> np.ndarray:
    """`rows[index]`, an index of -1 being the last."""
    return np.asarray(rows.T.take(index, axis=1, mode="wrap").T)


def put(rows: np.ndarray, index: np.ndarray, values: np.ndarray) -> None:
    """`rows[index] = values`."""
    for column, value in zip(rows.T, values.T, strict=True):
        column[index] = value


def turned(rows: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """`rows` (n,3) turned by `rotation` (3,3)."""
    return np.asarray((rotation.astype(rows.dtype) @ rows.T).T)


def outer(values: np.ndarray, row: np.ndarray) -> np.ndarray:
    """`row` (3,) times each of `values` (n,), as rows (n,3)."""
    return np.multiply.outer(row, values).T


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar product (n,) of each row of `a` with its row of `b`."""
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2])
