# SPDX-License-Identifier: MIT
"""How many matches agree with a pose, for many poses at once, and the best pose for those that agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.geometry.kabsch import kabsch

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Residuals computed at a time: as float32 they fill half of a 512 kB cache.
_CHUNK = 1 << 16
# The expanded square cancels terms of the size of the extent's square. Where the threshold's square is larger
# than this share of it, float32 keeps enough digits.
_COARSE = 50.0 * float(np.finfo(np.float32).eps)
_MOST_REFITS = 10  # by hand
_LEAST_GAIN = 1e-3  # share; a refit that gains less moves the pose by millimetres


@dataclass(frozen=True, eq=False)
class Support:
    """A pose with the matches that agree with it."""

    T: Array  # (4, 4)
    inliers: Mask  # (K,)
    n_inliers: int
    score: float  # the count, a match weighing less the larger its residual (MSAC, Torr and Zisserman 2000)


class Consensus:
    """Matches that poses are tested against.

    The square of a residual, `|R p + t - q|^2`, is linear in 17 products of the match's coordinates, with coefficients
    that depend on the pose alone. So the residuals of many poses are one matrix product, of which
    only the sign of (square - threshold) is wanted.

    Parameters
    ----------
    source, target : (K, 3)
    weight : (K,)
        Weights of the matches in refits; counts are unweighted.
    max_distance : float
        Metres; a match agrees when its residual is smaller.
    """

    def __init__(self, source: Array, target: Array, weight: Array, max_distance: float) -> None:
        self.source, self.target, self.weight, self.max_distance = source, target, weight, max_distance
        self._middle = source.mean(axis=0), target.mean(axis=0)
        p, q = source - self._middle[0], target - self._middle[1]
        squares = np.sum(p * p, axis=1) + np.sum(q * q, axis=1)
        products = (q[:, :, None] * p[:, None, :]).reshape(-1, 9)
        columns = np.column_stack([products, p, q, squares, np.ones(len(p))])
        coarse = max_distance**2 > _COARSE * float(squares.max(initial=0.0))
        self._columns = np.ascontiguousarray(columns.T, dtype=np.float32 if coarse else np.float64)  # (17, K)

    def __len__(self) -> int:
        return len(self.source)

    def counts(self, T: Array) -> NDArray[np.int64]:
        """Number of matches that agree with each of the poses (B, 4, 4)."""
        coefficients = self._coefficients(T).astype(self._columns.dtype)
        step = max(1, _CHUNK // max(len(self), 1))
        counts = np.empty(len(T), dtype=np.int64)
        for start in range(0, len(T), step):
            agree = coefficients[start : start + step] @ self._columns < 0.0
            # Row by row, because count_nonzero is vectorised for one dimension only.
            counts[start : start + step] = [np.count_nonzero(row) for row in agree]
        return counts

    def _coefficients(self, T: Array) -> Array:
        R = T[:, :3, :3]
        t = T[:, :3, 3] + np.einsum("bij,j->bi", R, self._middle[0]) - self._middle[1]
        ones = np.ones((len(T), 1))
        constant = np.sum(t * t, axis=1, keepdims=True) - self.max_distance**2
        back = np.einsum("bij,bi->bj", R, t)
        return np.hstack([-2.0 * R.reshape(-1, 9), 2.0 * back, -2.0 * t, ones, constant])

    def support(self, T: Array) -> Support:
        """Matches that agree with one pose, in full precision."""
        residual = np.einsum("ki,ji->kj", self.source, T[:3, :3]) + T[:3, 3] - self.target
        share = np.einsum("ki,ki->k", residual, residual) / self.max_distance**2
        inliers = share < 1.0
        return Support(T, inliers, int(np.count_nonzero(inliers)), float(np.sum(1.0 - share[inliers])))

    def refit(self, best: Support) -> Support:
        """Fit to the matches that agree, and again while they agree better (LO-RANSAC, Chum et al. 2003)."""
        for _ in range(_MOST_REFITS):
            rows = best.inliers
            T, status = kabsch(self.source[rows], self.target[rows], self.weight[rows])
            if status != "ok":
                return best
            again = self.support(T)
            if again.score <= best.score:
                return best
            gained, best = again.score - best.score, again
            if gained < _LEAST_GAIN * best.score:
                return best
        return best


def distances(poses: Array, T: Array, centre: Array) -> tuple[Array, Array]:
    """Distances of poses (B, 4, 4) from T (4, 4): in degrees, and in metres between the places to which they map
    `centre`.

    The difference of translations would depend on where the frame's origin lies.
    """
    trace = np.einsum("bij,ij->b", poses[:, :3, :3], T[:3, :3])
    degrees = np.degrees(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)))
    moved = np.einsum("bij,j->bi", poses[:, :3, :3], centre) + poses[:, :3, 3]
    return degrees, np.linalg.norm(moved - se3.apply(T, centre[None]), axis=1)
