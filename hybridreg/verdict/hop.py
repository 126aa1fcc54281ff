# SPDX-License-Identifier: MIT
"""The best supported of the places near a pose where surfaces let it rest.

Where clouds share a wall and a few things, a pose rests at several places some decimetres or degrees apart, and comes
to the one that lies nearest to where it began; the support tells which of them is right.
"""

from __future__ import annotations

from itertools import cycle

import numpy as np
from numpy.typing import NDArray

from hybridreg import se3
from hybridreg.resolution import map_cell
from hybridreg.scene import Scene
from hybridreg.verdict import support, views
from hybridreg.verdict.closeness import closeness, settle_closely
from hybridreg.verdict.rivals import Rival
from hybridreg.verdict.settle import settle

Array = NDArray[np.float64]

# Hops from each pose, and the standard deviations of one: degrees about each axis; along it, in turn, spacings, which
# count as so much of a map's cell at least.
_HOPS, _TURN_DEG, _SHIFTS, _LEAST = 10, 3.0, (1.0, 4.0), 0.3
# So many-th of the settling points, of the asked points, and of those asked about closely are used.
_SETTLING, _LOOKING, _CLOSELY = 3, 3, 4


def hop(scene: Scene, T_target_source: Array, rng: np.random.Generator) -> Rival:
    """Where basin hopping (Wales and Doye 1997) for more support ends that begins at a pose (4, 4).

    The pose is shaken, settles anew, roughly and closely, and stays where it has more support and lies closer.
    """
    source, target = views.views(scene)
    spacing = views.spacing(scene)
    middle = source.points.mean(axis=0)
    step = max(spacing, _LEAST * map_cell(scene.pair.source, scene.pair.target))

    def seen(T: Array) -> float:
        close = closeness(scene, T, _CLOSELY)
        return support.of(source, target, T, spacing, _LOOKING) + support.beside(0.0, close)

    T, best = T_target_source, seen(T_target_source)
    for _, shift in zip(range(_HOPS), cycle(_SHIFTS), strict=False):
        start = _shaken(T, middle, shift * step, rng)
        roughly = settle(source, target, start, spacing, every=_SETTLING)
        for settled in (roughly, settle_closely(scene, roughly)):
            value = seen(settled)
            if value > best:
                T, best = settled, value
    return Rival(T, support.of(source, target, T, spacing))


def _shaken(T: Array, middle: Array, shift: float, rng: np.random.Generator) -> Array:
    # About the middle of the source, so that a turn leaves it where it is.
    centre = se3.apply(T, middle[None])[0]
    turn = se3.rotation_about(np.radians(rng.normal(0.0, _TURN_DEG, 3)))
    return se3.about(centre, turn, rng.normal(0.0, shift, 3)) @ T
