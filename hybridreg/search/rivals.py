# SPDX-License-Identifier: MIT
"""Poses that might explain the data as well: what an estimator offers, a turn, the same things a few metres on."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.evidence.surface_distance import settle_closely
from hybridreg.evidence.views import Views
from hybridreg.matches import Pose
from hybridreg.resolution import tolerance
from hybridreg.scene import Scene
from hybridreg.search import settle
from hybridreg.search.axis_turns import TURNS, poses
from hybridreg.search.hypothesis import Hypothesis, as_hypotheses, parted, seen_at
from hybridreg.search.near_copies import are_two_places, near_copies
from hybridreg.search.ranking import best, differs, distinct, with_matches
from hybridreg.search.repeats import copies

Array = NDArray[np.float64]

# Rivals that the estimator offers, the best first; by hand.
_OFFERED = 4
# Most promising guesses about a pose that are settled; by hand.
_SETTLED = 4
# Turned poses at which most surfaces meet, settled whatever they promise: half a cell off, a room promises nothing.
_FULLEST = 4
# Rivals that are enough; by hand.
_ENOUGH = 4
# Log-odds below the pose's from which a rival is none to speak of: by hand.
_CONTENDS = 6.0
# The same for a copy just beside the pose: of maps that hold every wall twice it lies at most 2.3 below; by hand.
_COPIED = 3.5
# Cosine of the angle by which a turn may tilt the ground: by hand.
_UPRIGHT = 0.9
# Strides over the sampled points: for a guess's promise, and once it is settled.
_QUICK, _CLOSE = 10, 2


def find(scene: Scene, own: Hypothesis, pose: Pose) -> list[Hypothesis]:
    """Settled rivals of a pose, the likeliest first; `own` is the pose by itself, its matches counted."""
    views, centre = own.at.views, own.at.information.centre

    def is_rival(T: Array) -> bool:
        return differs(T, own.T, centre, views.spacing)

    known, guesses = parted(as_hypotheses(pose)[1 : 1 + _OFFERED])
    # A pose that is weighed again, beside what another entry found, lies among the same surfaces.
    around = scene.shared(("around", own.T.tobytes()), lambda: _around(own.at, is_rival))
    rivals = [*known, *_settled(views, [T for T in guesses if is_rival(T)]), *around]
    # Guesses that come back to the pose are no rivals, and two that meet are one; neither must hide those behind them.
    apart = distinct(scene, (with_matches(scene, one) for one in rivals if is_rival(one.T)))[:_ENOUGH]

    def came_to_rest(one: Hypothesis) -> bool:
        # Where surfaces hold a pose loosely, a rival may have stopped on its way to it.
        return one.log_odds < own.log_odds - _CONTENDS or is_rival(settle_closely(views.fine, one.T))

    return distinct(scene, [*(one for one in apart if came_to_rest(one)), *_beside(scene, own)])


def _around(own: PoseEvidence, is_rival: Callable[[Array], bool]) -> list[Hypothesis]:
    # What looks alike after a turn or a shift, settled.
    views, turned = own.views, _turned(own)
    guesses = [*turned[_FULLEST:], *copies(views, own.T, own.agreement.axes)]
    likeliest = best(seen_at(views.scene, [T for T in guesses if is_rival(T)], _QUICK))[:_SETTLED]
    return _settled(views, [*(one.T for one in likeliest), *filter(is_rival, turned[:_FULLEST])])


def _settled(views: Views, guesses: Sequence[Array]) -> list[Hypothesis]:
    return seen_at(views.scene, settle.settle(views, np.array(guesses).reshape(-1, 4, 4)), _CLOSE)


def _beside(scene: Scene, own: Hypothesis) -> list[Hypothesis]:
    # The likeliest copy of the place just beside the pose, if any contends.
    if own.log_odds < -_CONTENDS:
        return []
    views, allowed = own.at.views, tolerance(scene.pair.source, scene.pair.target)
    beside = scene.shared(
        ("beside", own.T.tobytes()),
        lambda: seen_at(scene, near_copies(views, own.T, own.at.agreement.axes, allowed), _CLOSE),
    )
    likeliest = best(with_matches(scene, one) for one in beside)[:1]
    return [
        one
        for one in likeliest
        if one.log_odds > own.log_odds - _COPIED and are_two_places(views, own.T, one.T)
    ]


def _turned(own: PoseEvidence) -> Array:
    # What looks alike after a turn that maps the place's main axes onto one another: a room after half a turn, a box
    # after a quarter of one. Where both clouds show the ground, only about the vertical.
    views, axes = own.views, own.agreement.axes
    turns = axes.T @ TURNS[1:] @ axes
    if (up := views.up) is not None:
        turns = turns[np.einsum("i,kij,j->k", up, turns, up) > _UPRIGHT]
    return poses(views, axes, turns @ own.T[:3, :3])
