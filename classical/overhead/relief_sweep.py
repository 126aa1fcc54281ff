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
# Yaws at once: for memory.
_BATCH = 4
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
    xs, xt = (se3.apply(r.T_level_cloud, r.places)[:, :2] for r in (source, target))
    if min(len(xs), len(xt)) < _FEWEST:
        return []
    # Wrapped round: a shift of at most `farthest` may not bring one end of a map upon the other.
    reach = max(float(np.hypot(*x.T).max()) for x in (xs, xt))
    n = fft.next_fast_len(int(np.ceil((2.0 * reach + min(farthest, 2.0 * reach)) / cell)) + 2, real=True)
    place = cell * np.fft.fftfreq(n, 1.0 / n)
    height, square, known = fft.rfft2(_maps(xt, target.heights, n, cell), workers=n_threads())
    best = BestYaws(n)
    yaws = np.arange(0.0, 360.0, _YAW_STEP_DEG)
    for batch in np.array_split(yaws, -(-len(yaws) // _BATCH)):
        turned = [_maps(xs @ se3.yaw(yaw)[:2, :2].T, source.heights, n, cell) for yaw in batch]
        h, q, k = np.moveaxis(np.conj(fft.rfft2(np.stack(turned), workers=n_threads())), 1, 0)
        products = np.stack([h * height, q * known, k * square, k * known])
        across, own, other, cells = fft.irfft2(products, s=(n, n), workers=n_threads())
        loud = np.sqrt(np.maximum(own * other, np.finfo(np.float32).tiny))
        speaks = (cells > _FEWEST - 0.5) & (across > 0.0)
        told = np.where(speaks, nats(cells, across / loud), -np.inf).astype(np.float32)
        for yaw, score in zip(batch, told, strict=True):
            best.keep(float(np.radians(yaw)), score)
    return best.peaks(place, farthest, most, share=0.0).matrices


def _maps(places: Array, heights: Array, n: int, cell: float) -> Floats:
    # Heights, their squares, and which cells are known (3, n, n); they wrap round at n cells.
    i, j = np.floor(places / cell + 0.5).astype(np.int64).T % n
    key = i * n + j
    count = np.bincount(key, minlength=n * n)
    mean = np.bincount(key, heights, minlength=n * n) / np.maximum(count, 1)
    return np.stack([mean, mean * mean, count > 0]).reshape(3, n, n).astype(np.float32)
