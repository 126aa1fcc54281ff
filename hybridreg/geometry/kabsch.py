# SPDX-License-Identifier: MIT
"""The rigid motion that fits pairs of points best in the least-squares sense (Kabsch 1976)."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3

Array = NDArray[np.float64]
Status = Literal["ok", "degenerate", "few", "nan"]

STATUSES: tuple[Status, ...] = ("ok", "degenerate", "few", "nan")
_OK, _DEGENERATE, _FEW, _NAN = range(4)
# Points on one line leave the rotation about it free; their covariance then has only one singular value.
_COLLINEAR = 1e-6
# Below this share of its coordinates a cloud's extent is rounding noise: all points are one.
_NO_EXTENT = 1e-10


class Fits(NamedTuple):
    """Rigid motions of a batch.

    T : (..., 4, 4) float64, identity where the status is "few" or "nan"
    status : (...) int8, index into `STATUSES`
    """

    T: Array
    status: NDArray[np.int8]


def kabsch(source: Array, target: Array, weight: Array | None = None) -> tuple[Array, Status]:
    """Rotation and translation that minimise `sum w |R p + t - q|^2` (Kabsch 1976).

    Parameters
    ----------
    source, target : (K, 3), metres
    weight : (K,), not negative, or None for ones

    Returns
    -------
    T : (4, 4)
    status : "ok"; "degenerate" for points on one line, where T is one of many best motions; "few" for less
        than 3 matches or no weight, and "nan" for numbers that are not finite, where T is the identity
    """
    fits = kabsch_batch(source[None], target[None], None if weight is None else weight[None])
    return fits.T[0], STATUSES[int(fits.status[0])]


def kabsch_batch(source: Array, target: Array, weight: Array | None = None) -> Fits:
    """`kabsch` for a batch: source and target (B, K, 3), weight (B, K) or None."""
    source, target = np.asarray(source, dtype=np.float64), np.asarray(target, dtype=np.float64)
    n_fits, n = source.shape[:2]
    w = np.ones((n_fits, n)) if weight is None else np.asarray(weight, dtype=np.float64)
    total = w.sum(axis=1)
    # Divided by the exact sum: GeoTransformer's sum + 1e-5 pulls centroids towards the origin where weights are small.
    enough = (total >= 1e-8) & (n >= 3)
    w = w / np.where(enough, total, 1.0)[:, None]
    # einsum runs numpy's own loops, so that no BLAS thread count changes the last bit.
    middle_source = np.einsum("bk,bki->bi", w, source)
    middle_target = np.einsum("bk,bki->bi", w, target)
    p, q = source - middle_source[:, None], target - middle_target[:, None]
    H = np.einsum("bki,bkj->bij", w[:, :, None] * p, q)
    finite = np.isfinite(H).all(axis=(1, 2)) & np.isfinite(total)
    usable = enough & finite
    R, spread = _rotations(np.where(usable[:, None, None], H, 0.0))
    t = middle_target - np.einsum("bij,bj->bi", R, middle_source)
    T = np.where(usable[:, None, None], se3.from_rt(R, t), np.eye(4))
    thin = (spread[:, 1] <= _COLLINEAR * spread[:, 0]) | (spread[:, 0] <= _rounding(source, target))
    status = np.select([n < 3, ~finite, ~enough, thin], [_FEW, _NAN, _FEW, _DEGENERATE], default=_OK)
    return Fits(T, status.astype(np.int8))


def _rotations(H: Array) -> tuple[Array, Array]:
    # H = sum w p q^T = U S V^T, so R = V diag(1, 1, det(V U^T)) U^T maps p to q.
    U, S, Vt = np.linalg.svd(H)
    V = np.swapaxes(Vt, 1, 2)
    flip = np.where(np.linalg.det(U) * np.linalg.det(V) < 0.0, -1.0, 1.0)
    V[:, :, 2] *= flip[:, None]
    return np.einsum("bij,bkj->bik", V, U), S


def _rounding(source: Array, target: Array) -> Array:
    # Size of a covariance that rounding alone can produce.
    largest = [np.abs(c).max(axis=(1, 2), initial=0.0) for c in (source, target)]
    return (_NO_EXTENT * largest[0]) * (_NO_EXTENT * largest[1])
