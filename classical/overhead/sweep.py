# SPDX-License-Identifier: MIT
"""Correlation of two clouds seen from above at all yaws and shifts, by FFT."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.overhead.overhead_columns import FromAbove
from hybridreg.classical.overhead.signed_map import blurred, signed
from hybridreg.geometry import se3
from hybridreg.runtime.cores import n_threads

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
Complexes = NDArray[np.complex64]

# Yaws transformed at once: for memory.
_BATCH = 4
# Sectors of yaw in which a shift keeps a best yaw of its own: a street may be turned round; by hand.
_SECTORS = 4
# Cells along a map, at most: time and memory grow with their square.
_LONGEST = 512
# Share of a spectrum's mean below which a part is noise, and is not amplified; by hand.
_QUIET = 0.01


class Planar(NamedTuple):
    """Poses on the ground: yaw (k,) radians, shift (k,) complex metres, score (k,), the best first."""

    yaw: Array
    shift: NDArray[np.complex128]
    score: Array

    @property
    def matrices(self) -> list[Array]:
        """The same as motions (4, 4)."""
        motions = []
        for yaw, shift in zip(self.yaw, self.shift, strict=True):
            T = se3.yaw(float(np.degrees(yaw)))
            T[:2, 3] = shift.real, shift.imag
            motions.append(T)
        return motions


class BestYaws:
    """The best score of each shift and its yaw, for each sector of yaws.

    `place` (n,): metres of a map's rows, which wrap round; shifts longer than `farthest` metres are left out.
    """

    def __init__(self, place: Array, farthest: float) -> None:
        # And those just beyond, so that the longest shifts have neighbours.
        self._rows = np.flatnonzero(np.abs(place) < farthest + 2.0 * place[1])
        self._place = place[self._rows]
        self._too_far = np.hypot(self._place[:, None], self._place) > farthest
        self._score = np.full((_SECTORS, *self._too_far.shape), -np.inf, dtype=np.float32)
        self._yaw = np.zeros(self._score.shape)

    def near(self, maps: Floats) -> Floats:
        """Of maps (..., n, n) the shifts (..., m, m) that count."""
        return maps.take(self._rows, axis=-2).take(self._rows, axis=-1)

    def keep(self, yaw: float, score: Floats) -> None:
        """Take in the scores (m, m) of one yaw, radians in [0, 2 pi)."""
        sector = int(_SECTORS * yaw / (2.0 * np.pi))
        better = score > self._score[sector]
        np.copyto(self._score[sector], score, where=better)
        np.copyto(self._yaw[sector], yaw, where=better)

    def peaks(self, most: int, share: float) -> Planar:
        """Shifts that score higher than those around them; `most` and `share` as in `sweep`."""
        from scipy.ndimage import maximum_filter

        best = self._score
        best[:, self._too_far] = -np.inf
        peak = (best == maximum_filter(best, (1, 3, 3), mode="wrap")) & np.isfinite(best)
        sector, i, j = np.nonzero(peak)
        score = best[sector, i, j].astype(np.float64)
        first = np.argsort(-score, kind="stable")[:most]
        first = first[score[first] >= share * score[first[:1]]]
        sector, i, j = sector[first], i[first], j[first]
        return Planar(self._yaw[sector, i, j], self._place[i] + 1j * self._place[j], score[first])


def sweep(
    source: FromAbove,
    target: FromAbove,
    *,
    cell: float,
    yaws: Array,
    farthest: float,
    most: int,
    share: float,
    whiten: float = 0.0,
) -> Planar:
    """Peaks of the correlation of two signed maps: filled columns count +1, free ones a little below zero.

    Parameters
    ----------
    cell : float
        Edge of a map's cell, metres.
    yaws : (k,)
        Radians, rising from 0 to below pi. Each is tried with the half turn beyond it, whose spectra are the conjugate
        ones.
    farthest : float
        Largest shift, metres.
    most : int
        Peaks returned, at most.
    share : float
        Of the best one's score that a peak needs.
    whiten : float in [0, 1]
        How far the spectra are levelled (1 is phase correlation). Long walls agree with themselves wherever they are
        slid to; levelled, they count as little as what is short and stands alone.

    Raises
    ------
    ValueError
        The clouds reach so far from the axis that they turn about that their maps would not fit in memory.
    """
    from scipy import fft

    across = _extent(source) + _extent(target) + 2.0 * cell
    if across > _LONGEST * cell:
        raise ValueError(
            f"bird's-eye search: maps about the clouds' origins have {across / cell:.3g} cells of {cell:.3g} m along a "
            f"side, more than {_LONGEST}; move each cloud's sensor, or its middle, to its origin"
        )
    n = fft.next_fast_len(int(np.ceil(across / cell)), real=True)
    place: Array = cell * np.fft.fftfreq(n, 1.0 / n).astype(np.float64)
    spectrum = fft.rfft2(blurred(signed(target, 1.0, n, cell)), workers=n_threads())
    # Half a turn brings cell k to cell -k - 1: a phase besides the conjugate.
    u, v = np.fft.fftfreq(n).astype(np.float32)[:, None], np.arange(spectrum.shape[2], dtype=np.float32) / n
    half_turn = np.exp(np.complex64(-2j * np.pi) * (u + v))
    best = BestYaws(place, farthest)
    for batch in np.array_split(yaws, -(-len(yaws) // _BATCH)):
        turned = np.stack([signed(source, np.exp(1j * yaw), n, cell) for yaw in batch])
        product = _products(fft.rfft2(turned, workers=n_threads()), spectrum, half_turn, whiten)
        both = np.concatenate([batch, batch + np.pi])
        scores = best.near(fft.irfft2(product, s=(n, n), workers=n_threads()))
        for yaw, score in zip(both, scores, strict=True):
            best.keep(yaw, score)
    return best.peaks(most, share)


def _products(source: Complexes, target: Complexes, half_turn: Complexes, whiten: float) -> Complexes:
    # Of spectra (yaws, layers, n, m) and (layers, n, m), summed over the layers: of the source as it is, then turned by
    # half a turn, whose phase (n, m) is `half_turn`.
    as_it_is = (np.conj(source) * target).sum(axis=1)
    half_turned = (source * target).sum(axis=1) * half_turn
    products: Complexes = np.stack([as_it_is, half_turned])
    if whiten > 0.0:
        loud = np.sqrt((np.abs(source) ** 2).sum(axis=1) * (np.abs(target) ** 2).sum(axis=0))
        products /= np.maximum(loud, _QUIET * loud.mean(axis=(1, 2), keepdims=True)) ** whiten
    return products.reshape(-1, *half_turn.shape)


def _extent(view: FromAbove) -> float:
    # Twice the greatest distance of a filled column, whatever the yaw.
    return 2.0 * float(np.abs(view.filled.places).max(initial=0.0)) / np.sqrt(2.0)
