# SPDX-License-Identifier: MIT
"""Correlation of two ground reliefs at all yaws and shifts, by FFT."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.overhead.sweep import BestYaws
from hybridreg.geometry import se3
from hybridreg.geometry.ground_relief import Relief, nats
from hybridreg.runtime.cores import n_threads

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

# Edge of a cell of the search, cells of the reliefs, whose undulations are metres wide; by hand.
COARSE = 2.0
# Degrees between yaws; by hand.
_YAW_STEP_DEG = 2.0
# Yaws at once, and as many half a turn beyond: for memory.
_BATCH = 2
# Fewest common cells; by hand.
_FEWEST = 25


def search(source: Relief, target: Relief, farthest: float, most: int) -> list[Array]:
    """Motions (4, 4) along the ground from the source's level frame to the target's, the likeliest first.

    The correlation is that of the cells which both reliefs know (masked normalised cross-correlation, Padfield 2012);
    a motion's rank is the information in it, as few cells agree by chance more easily than many.

    Parameters
    ----------
    farthest : float
        Largest shift, metres.
    most : int
        Motions returned, at most.
    """
    from scipy import fft

    cell = COARSE * target.cell
    (xs, hs), (xt, ht) = ((se3.apply(r.T_level_cloud, r.places)[:, :2], r.heights) for r in (source, target))
    if min(len(xs), len(xt)) < _FEWEST:
        return []
    # What no shift brings upon the other map is left out, and no shift may bring one end of a map upon the other.
    far_s, far_t = (np.hypot(*x.T) for x in (xs, xt))
    near_s, near_t = far_s <= far_t.max() + farthest, far_t <= far_s.max() + farthest
    (xs, hs), (xt, ht) = (xs[near_s], hs[near_s]), (xt[near_t], ht[near_t])
    across = far_s.max(where=near_s, initial=0.0) + far_t.max(where=near_t, initial=0.0)
    n = fft.next_fast_len(int(np.ceil((across + min(farthest, across)) / cell)) + 3, real=True)
    place = cell * np.fft.fftfreq(n, 1.0 / n)
    height, square, known = fft.rfft2(_maps(xt, ht, n, cell), workers=n_threads())
    best = BestYaws(place, farthest)
    yaws = np.arange(0.0, 180.0, _YAW_STEP_DEG)
    for batch in np.array_split(yaws, -(-len(yaws) // _BATCH)):
        turned = fft.rfft2(
            np.stack([_maps(xs @ se3.yaw(yaw)[:2, :2].T, hs, n, cell) for yaw in batch]),
            workers=n_threads(),
        )
        # The half turn beyond each yaw has the conjugate spectra.
        h, q, k = np.moveaxis(np.concatenate([np.conj(turned), turned]), 1, 0)
        products = np.stack([h * height, q * known, k * square, k * known])
        shared, own, other, cells = best.near(fft.irfft2(products, s=(n, n), workers=n_threads()))
        loud = np.sqrt(np.maximum(own * other, np.finfo(np.float32).tiny))
        speaks = (cells > _FEWEST - 0.5) & (shared > 0.0)
        told = np.where(speaks, nats(cells, shared / loud), -np.inf).astype(np.float32)
        for yaw, score in zip(np.concatenate([batch, batch + 180.0]), told, strict=True):
            best.keep(float(np.radians(yaw)), score)
    return best.peaks(most, share=0.0).matrices


def _maps(places: Array, heights: Array, n: int, cell: float) -> Floats:
    # Heights, their squares, and which cells are known (3, n, n); they wrap round at n cells.
    i, j = np.floor(places / cell + 0.5).astype(np.int64).T % n
    key = i * n + j
    count = np.bincount(key, minlength=n * n)
    mean = np.bincount(key, heights, minlength=n * n) / np.maximum(count, 1)
    return np.stack([mean, mean * mean, count > 0]).reshape(3, n, n).astype(np.float32)
