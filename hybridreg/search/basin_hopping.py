# SPDX-License-Identifier: MIT
"""Basin hopping: the likeliest of the local minima near a pose.

Where clouds share a wall and little else, ICP has several minima some decimetres or degrees apart and ends in the one
nearest to its start; the log-odds show which of them is right.
"""

from __future__ import annotations

from itertools import cycle

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import log_odds, views
from hybridreg.evidence.surface_distance import closeness, settle_closely
from hybridreg.geometry import se3
from hybridreg.resolution import map_cell
from hybridreg.scene import Scene
from hybridreg.search.hypothesis import Hypothesis, seen_at
from hybridreg.search.settle import settle

Array = NDArray[np.float64]

# Hops from each pose; by hand.
_HOPS = 10
# Standard deviation of a hop about each axis, degrees; by hand.
_TURN_DEG = 3.0
# Standard deviations along each axis, taken in turn, spacings; by hand.
_SHIFTS = (1.0, 4.0)
# A spacing counts as this share of a map's cell at least; by hand.
_LEAST = 0.3
# Strides over the settling points, the sampled points, and those compared closely: for speed.
_SETTLING, _LOOKING, _CLOSELY = 3, 3, 4


def hop(scene: Scene, poses: Array, rng: np.random.Generator) -> list[Hypothesis]:
    """Where basin hopping (Wales and Doye 1997) for higher log-odds ends that begins at each of some poses (b, 4, 4).

    A pose is shaken, settles anew, roughly and closely, and stays where it is likelier.
    """
    both = views.of(scene)
    step = max(both.spacing, _LEAST * map_cell(scene.pair.source, scene.pair.target))

    def seen(poses: Array) -> Array:
        close = [log_odds.beside(0.0, closeness(both.fine, T, _CLOSELY)) for T in poses]
        return np.array(log_odds.of_each(both, poses, _LOOKING)) + close

    poses, best = poses.copy(), seen(poses)
    for _, shift in zip(range(_HOPS), cycle(_SHIFTS), strict=False):
        starts = np.array([_shaken(T, both.middle, shift * step, rng) for T in poses])
        roughly = settle(both, starts, stride=_SETTLING)
        for settled in (roughly, settle_closely(both.fine, roughly)):
            value = seen(settled)
            better = value > best
            poses[better], best[better] = settled[better], value[better]
    return seen_at(scene, poses, 1)


def _shaken(T: Array, middle: Array, shift: float, rng: np.random.Generator) -> Array:
    # Rotated about the centroid of the source, so that a rotation leaves it in place.
    centre = se3.apply(T, middle)[0]
    turn = se3.rotation_about(np.radians(rng.normal(0.0, _TURN_DEG, 3)))
    return se3.about(centre, turn, rng.normal(0.0, shift, 3)) @ T
