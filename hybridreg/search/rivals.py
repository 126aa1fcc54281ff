# SPDX-License-Identifier: MIT
"""Poses that might explain the data as well: what an estimator offers, half a turn, the same things a few metres on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import match_agreement
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.evidence.surface_distance import settle_closely
from hybridreg.geometry import se3
from hybridreg.matches import Pose
from hybridreg.scene import Scene
from hybridreg.search.hypothesis import Hypothesis, as_hypotheses, parted, seen_at
from hybridreg.search.ranking import best, differs
from hybridreg.search.repeats import copies
from hybridreg.search.settle import settle

Array = NDArray[np.float64]

# Rivals that the estimator offers, the best first; by hand.
_OFFERED = 4
# Most promising guesses that are settled; by hand.
_SETTLED = 8
# Rivals that are enough; by hand.
_ENOUGH = 4
# Log-odds below the pose's from which a rival is none to speak of: by hand.
_CONTENDS = 6.0
# Strides over the sampled points: for a guess's promise, and once it is settled.
_QUICK, _CLOSE = 10, 2


def find(scene: Scene, own: PoseEvidence, pose: Pose) -> list[Hypothesis]:
    """Settled rivals of a pose, the likeliest first; `own` is its evidence."""
    views, centre = own.views, own.information.centre

    def is_rival(T: Array) -> bool:
        return differs(T, own.T, centre, views.spacing)

    def with_matches(one: Hypothesis) -> Hypothesis:
        return one.but(matched=match_agreement.share(scene, one.T), closeness=0.0, found_by=1)

    known, guesses = parted(as_hypotheses(pose)[1 : 1 + _OFFERED])
    guesses += [*_turned(own), *copies(views, own.T, own.agreement.axes)]
    promising = [*known, *seen_at(scene, [T for T in guesses if is_rival(T)], _QUICK)]
    likeliest = best(with_matches(one) for one in promising if is_rival(one.T))[:_SETTLED]
    guessed = np.array([one.T for one in likeliest if not one.settled]).reshape(-1, 4, 4)
    moved = iter(seen_at(scene, settle(views, guessed), _CLOSE))
    rivals = [one if one.settled else next(moved) for one in likeliest]
    # Guesses that come back to the pose are no rivals, and must not hide those behind them.
    apart = best([with_matches(one) for one in rivals if is_rival(one.T)][:_ENOUGH])

    def came_to_rest(one: Hypothesis) -> bool:
        # Where surfaces hold a pose loosely, a rival may have stopped on its way to it.
        far_behind = one.log_odds < own.by_surfaces - _CONTENDS
        return far_behind or is_rival(settle_closely(views.fine, one.T))

    return [one for one in apart if came_to_rest(one)]


def _turned(own: PoseEvidence) -> list[Array]:
    # Half a turn through the centre of the overlap about the axis that most surfaces face (the vertical, where there
    # is ground); and about each axis so that the middles of both clouds meet, which is where a room repeats.
    axes, centre = own.agreement.axes, own.information.centre
    middle = _middle(own.views.target.points, axes)
    guesses = []
    for axis in axes:
        half = se3.rotation_about(np.pi * axis)
        about = se3.about(centre, half) @ own.T
        gap = middle - _middle(se3.apply(about, own.views.source.points), axes)
        guesses += [about, se3.from_rt(np.eye(3), gap - axis * (gap @ axis)) @ about]
    return [guesses[0], *guesses[1::2]]


def _middle(points: Array, axes: Array) -> Array:
    # Midway between the outer twentieths along each axis: a centroid would follow the sensor.
    low, high = np.quantile(points[:: max(1, len(points) // 2_000)] @ axes.T, [0.05, 0.95], axis=0)
    return 0.5 * (low + high) @ axes
