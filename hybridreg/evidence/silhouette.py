# SPDX-License-Identifier: MIT
"""One thing stands alone in both views: do its outlines coincide?

A figure looks from behind much as it does from in front. A pose that lays its back on its front, or lays it on another
figure, lets nearly all points agree but a few at the outline, past which the other sensor saw. At the right pose, from
wherever both sensors look, hardly any point lies beyond the outline that the other saw.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.views import View, Views

Array = NDArray[np.float64]

# Share of the visible points past which the other sensor may have seen, by hand: of 40 right poses of made figures,
# vans and machines from 15 to 40 degrees apart none has more than 0.011, of ten that lay a back on a front none less
# than 0.027.
_PAST = 0.02
# Share of the rectangle around the outline that the thing fills, at most; what ends where the view does, as a wall or a
# floor do, fills it all. By hand.
_FILLS = 0.8
# Cells along either side of that rectangle, and what lies beyond it, per cent at either end; by hand.
_CELLS, _BEYOND = 12, 1.0
# Points that show an outline, at least; by hand.
_FEWEST = 500
# Its distance from the sensor over its extent, at least, and the per cent of its points that make the extent; by hand.
_FAR, _MOST = 1.3, 90.0
# Cosine of the angle from the middle of a view to its rim, at least; by hand.
_NARROW = 0.2


def seen_past(views: Views, looked_through: float) -> bool:
    """Whether one thing stands alone in both views, and the share of its points that the other sensor `looked_through`
    is too much for outlines that coincide."""
    return looked_through > _PAST and all(_stands_alone(view) for view in (views.source, views.target))


def _stands_alone(view: View) -> bool:
    if view.image is None or len(view.points) < _FEWEST:
        return False
    centre = np.median(view.points, axis=0)
    extent = np.percentile(np.linalg.norm(view.points - centre, axis=1), _MOST)
    if np.linalg.norm(centre - view.centre) < _FAR * extent:
        return False
    outline = _on_plane(view.points - view.centre)
    if outline is None:
        return False
    low, high = np.percentile(outline, [_BEYOND, 100.0 - _BEYOND], axis=0)
    cells = np.floor((outline - low) / (high - low) * _CELLS).astype(np.int64)
    inside = cells[((cells >= 0) & (cells < _CELLS)).all(axis=1)]
    return len(np.unique(inside @ [_CELLS, 1])) < _FILLS * _CELLS**2


def _on_plane(rays: Array) -> Array | None:
    # Where rays (n, 3) meet a plane across the view, along the axes of what is seen there (n, 2); None of a wide view.
    ahead = (rays / np.linalg.norm(rays, axis=1, keepdims=True)).mean(axis=0)
    depth = rays @ ahead
    length = np.linalg.norm(ahead) * np.linalg.norm(rays, axis=1)
    if np.percentile(depth / length, _BEYOND) < _NARROW:
        return None
    flat = rays[depth > 0.0] @ np.linalg.svd(ahead[None])[2][1:].T / depth[depth > 0.0, None]
    flat -= np.median(flat, axis=0)
    turned: Array = flat @ np.linalg.eigh(flat.T @ flat)[1]
    return turned
