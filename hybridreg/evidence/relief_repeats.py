# SPDX-License-Identifier: MIT
"""Where is the ground's relief like itself elsewhere? What a pose shows no more alike than that tells nothing.

Furrows, gutters and waves repeat from one metre to the next, so that the relief of a wrong pose may correlate well.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.ground_relief import Alike, Relief

Array = NDArray[np.float64]

# Cells from which a place lies elsewhere: heights are those over a plane through the cells six to each side; by hand.
_ELSEWHERE = 7.0
# Share of its cells that a relief must have in common with itself elsewhere; by hand.
_SHARED = 0.25
# Neighbouring cells are alike, and so many count as one; of thousands of places some correlate by chance, by so many
# standard errors; by hand. Real grounds come to 0.5 at most, waves of three lengths to 0.8 and more.
_AS_ONE = 10.0
_BY_CHANCE = 3.0
# A correlation of one has no standard error.
_MOST = 0.999
_NOTHING = 1e-18


def beyond(found: Alike, repeats: float) -> Alike:
    """How similar two reliefs are beyond what `repeats`: the root of what share they explain of the rest."""
    if found.correlation <= 0.0 or repeats <= 0.0:
        return found
    left = (found.correlation**2 - repeats**2) / (1.0 - repeats**2)
    return found._replace(correlation=float(np.sqrt(max(left, 0.0))))


def repeats(relief: Relief) -> float:
    """Highest correlation, in [0, 1), of a relief with itself elsewhere, shifted, or turned by half a turn and shifted;
    less what chance makes of so few cells."""
    from scipy.fft import irfft2, next_fast_len, rfft2

    known = ~np.isnan(relief.grid)
    if not known.any():
        return 0.0
    part = tuple(slice(rows.min(), rows.max() + 1) for rows in np.nonzero(known))
    inside = known[part].astype(float)
    heights = np.where(known[part], relief.grid[part], 0.0)
    shape = [next_fast_len(2 * n - 1, real=True) for n in heights.shape]
    h, squares, mask = (rfft2(values, shape) for values in (heights, heights * heights, inside))

    def summed(a: Array, b: Array) -> Array:
        # Over the cells that a map and the other have in common, for every shift between them.
        found: Array = irfft2(a * b, shape)
        return found

    return max(
        _highest(summed(mask, m), summed(h, o), summed(squares, m), summed(mask, s), elsewhere)
        for o, s, m, elsewhere in (
            (h.conj(), squares.conj(), mask.conj(), _far(shape)),
            (h, squares, mask, np.ones(shape, dtype=bool)),  # turned
        )
    )


def _far(shape: list[int]) -> NDArray[np.bool_]:
    # Whether a shift, which is counted from either end, leads elsewhere.
    steps = (np.minimum(np.arange(n), n - np.arange(n)) for n in shape)
    away: NDArray[np.bool_] = np.hypot(*np.meshgrid(*steps, indexing="ij")) >= _ELSEWHERE
    return away


def _highest(cells: Array, products: Array, own: Array, others: Array, elsewhere: NDArray[np.bool_]) -> float:
    enough = elsewhere & (cells > _SHARED * cells.max())
    r = products[enough] / np.sqrt(np.maximum(own[enough] * others[enough], _NOTHING))
    surely = np.arctanh(np.clip(r, 0.0, _MOST)) - _BY_CHANCE * np.sqrt(_AS_ONE / cells[enough])  # Fisher
    return float(np.tanh(surely.max(initial=0.0)))
