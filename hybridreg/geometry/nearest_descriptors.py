# SPDX-License-Identifier: MIT
"""Nearest neighbours between two sets of descriptors, both ways in one pass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.runtime.threads import single

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# Rows of the distance matrix at a time. Of 16 to 512 tried, 128 was fastest.
_ROWS = 128


@dataclass(frozen=True, eq=False)
class Nearest:
    """For each source descriptor, its nearest target descriptor.

    row : (n,) int64, of the nearest target
    distance, second : (n,) float64, to the nearest and to the next one; infinite where there is no next
    mutual : (n,) bool, the nearest target has no nearer source descriptor; true once for each target at most
    """

    row: Indices
    distance: Array
    second: Array
    mutual: NDArray[np.bool_]


def nearest(source: Array, target: Array) -> Nearest:
    """Nearest neighbours by Euclidean distance, from every pairwise distance.

    In 33 dimensions a tree visits most of its leaves, so this is brute force: the squared distances are one
    float32 matrix product, made in blocks of rows that stay in the cache. One BLAS thread, so that the number
    of threads cannot decide a tie. `benchmarks/nearest_speed.py` compares it with four other libraries.

    Parameters
    ----------
    source, target : (n, d), (m, d), at least one row each
    """
    middle = 0.5 * (source.mean(axis=0) + target.mean(axis=0))
    a, b = source - middle, target - middle
    left = np.column_stack([-2.0 * a, _square(a), np.ones(len(a))]).astype(np.float32)
    right = np.column_stack([b, np.ones(len(b)), _square(b)]).T.astype(np.float32, order="C")
    index = np.empty(len(a), dtype=np.int64)
    best, second = np.empty(len(a), dtype=np.float32), np.empty(len(a), dtype=np.float32)
    column_best = np.full(len(b), np.inf, dtype=np.float32)
    with single():
        for start in range(0, len(a), _ROWS):
            block = slice(start, start + _ROWS)
            squares = left[block] @ right
            rows = np.arange(len(squares))
            index[block] = squares.argmin(axis=1)
            best[block] = squares[rows, index[block]]
            np.minimum(column_best, squares.min(axis=0), out=column_best)
            squares[rows, index[block]] = np.inf
            second[block] = squares.min(axis=1)
    lowest = best == column_best[index]
    alone = np.bincount(index[lowest], minlength=len(b))[index] == 1
    return Nearest(index, _root(best), _root(second), lowest & alone)


def _square(vectors: Array) -> Array:
    return np.einsum("nd,nd->n", vectors, vectors)


def _root(squares: NDArray[np.float32]) -> Array:
    return np.sqrt(np.maximum(squares.astype(np.float64), 0.0))
