# SPDX-License-Identifier: MIT
"""Poses that the pair's bounds shut out, told where nothing within is likely: the bounds may be what is wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hybridreg.matches import Pose
from hybridreg.scene import Scene
from hybridreg.search.hypothesis import Hypothesis
from hybridreg.search.ranking import HOPELESS
from hybridreg.search.settle import best_first
from hybridreg.verdict.confidence import CLEAR

Array = NDArray[np.float64]

# Poses that are looked at, the best of each entry first: by hand.
_LOOKED_AT = 6


def beyond(scene: Scene, pose: Pose) -> list[Array]:
    """What an entry found beyond the pair's bounds, its best one or two poses (4, 4)."""
    if scene.pair.bounds is None:
        return []
    return [T for T in (pose.T, *pose.rivals) if np.isfinite(T).all() and not scene.pair.allows(T)][:2]


def explanations(
    scene: Scene, shut: Sequence[Hypothesis | Array], found: Sequence[Hypothesis], *, sure: bool = False
) -> list[str]:
    """At most one sentence: where the likeliest pose beyond the bounds lies, if it is likelier than all within.

    Parameters
    ----------
    shut : what was found beyond, some of it not yet settled
    found : what was found within, the likeliest first
    sure : whether the best within would be "ok"; bounds are there to tell it from what is about as likely beyond
    """
    bounds = scene.pair.bounds
    if bounds is None or not shut:
        return []
    settled = [one for one in best_first(scene, list(shut[:_LOOKED_AT])) if not bounds.allow(one.T)]
    if not settled or settled[0].log_odds < HOPELESS:
        return []
    where = bounds.against(settled[0].T)
    if not found:
        return [f"every pose that was found was shut out, the likeliest lies {where}"]
    if settled[0].log_odds > found[0].log_odds + (CLEAR if sure else 0.0):
        return [f"a likelier pose was found and shut out: it lies {where}"]
    return []
