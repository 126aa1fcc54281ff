# SPDX-License-Identifier: MIT
"""Many starts, each moved by point-to-plane ICP: a pose is judged where it fits best, not where it was guessed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import views
from hybridreg.evidence.surface_distance import settle_closely
from hybridreg.evidence.views import Views
from hybridreg.geometry.point_to_plane import descend
from hybridreg.scene import Scene
from hybridreg.search.hypothesis import Found, Hypothesis, parted, seen_at
from hybridreg.search.ranking import HOPELESS, best, distinct

Array = NDArray[np.float64]

# Farthest partners of the steps, spacings: wide enough to pull in a guess that is some cells off, then tight; by hand.
_STEPS = (6.0, 4.0, 3.0, 2.0, 2.0)
# For a guess that may be two or three metres off: on a field, where few surfaces pull, a quicker descent comes to rest
# on the way; by hand.
_WIDE = (12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 2.0)
# Width of the weights where the search is wide, per farthest partner; by hand.
_TRUST = 0.25
# Strides over the sampled points: of the first ranking, of the second, of the second look.
_QUICK, _ROUGHLY, _CLOSE = 10, 3, 2
# Best of many starts that are settled closely, at most.
_KEPT = 8
# Those whose log-odds lie so far below the best are not: of 112 on 32 pairs of `sim:val` none came out the best.
_LEFT = 12.0
# Starts of the run that are looked at again when no pose is certain; by hand.
_AGAIN = 24


def settle(views: Views, T: Array, *, stride: int = 3, wide: bool = False) -> Array:
    """Poses (..., 4, 4) near those of T at which the source's settling points lie best on the target's planes.

    Many at once take a third of the time that they take one by one.

    Parameters
    ----------
    stride : int
        Every so many-th of the settling points is used.
    wide : bool
        Look for partners from twice as far, and trust far ones more at first.
    """
    spacing = views.spacing
    steps = [
        (step * spacing, spacing * (max(1.0, _TRUST * step) if wide else 1.0))
        for step in (_WIDE if wide else _STEPS)
    ]
    return descend(T, views.source.points[views.source.settling[::stride]], views.target, steps)


def at_rest(views: Views, T: Array) -> Array:
    """Where a pose (4, 4) comes to rest, (2, 4, 4): on the planes, and from there on surfaces as fine as the clouds
    show them."""
    roughly = settle(views, T)
    return np.array([roughly, settle_closely(views.fine, roughly)])


def best_first(scene: Scene, starts: Sequence[Array | Hypothesis]) -> list[Hypothesis]:
    """The likeliest of some starts, at most eight, each where it fits best; of those that meet, one.

    A settled hypothesis rests where it is; poses (4, 4) and other hypotheses are settled.
    """
    found = Found.of(scene)
    resting, poses = parted(starts)
    quickly = _settled(scene, poses, _ROUGHLY, _QUICK)
    found.starts.extend(quickly)
    # A tenth of the points tells most from the best; a third of them ranks those that are left.
    apart = best(seen_at(scene, [one.T for one in distinct(scene, quickly)[: 2 * _KEPT]], _ROUGHLY))[:_KEPT]
    near = [one for one in apart if one.log_odds > max(apart[0].log_odds - _LEFT, HOPELESS)] or apart[:1]
    closely = _settled(scene, [one.T for one in near], 1, 1)
    made = [one.but(settled=True) for one in [*closely, *apart[len(near) :]]]
    found.settled.extend(made)
    return distinct(scene, [*resting, *made])[:_KEPT]


def second_look(scene: Scene) -> list[Hypothesis]:
    """The likeliest of all starts of the run, each settled on surfaces as fine as the clouds show them.

    What a rough look took for one of many may lie closest of all.
    """
    tried = best(Found.of(scene).starts)[: 3 * _AGAIN]
    poses = np.array([one.T for one in distinct(scene, tried)[:_AGAIN]]).reshape(-1, 4, 4)
    return seen_at(scene, settle_closely(views.of(scene).fine, poses), _CLOSE)


def resting(scene: Scene, poses: Sequence[Array]) -> list[Hypothesis]:
    """Poses (4, 4) as they are, not to be settled in this run."""
    made = seen_at(scene, poses, 1, settled=True)
    Found.of(scene).settled.extend(made)
    return made


def _settled(scene: Scene, starts: Sequence[Array], stride: int, looked_at: int) -> list[Hypothesis]:
    poses = np.array(starts, dtype=np.float64).reshape(-1, 4, 4)
    return seen_at(scene, settle(views.of(scene), poses, stride=3 * stride, wide=stride == 1), looked_at)
