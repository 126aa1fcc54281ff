# SPDX-License-Identifier: MIT
"""The verdict on a pose."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import match_agreement
from hybridreg.geometry.fitness import Overlay
from hybridreg.matches import Correspondences, Pose
from hybridreg.resolution import tolerance
from hybridreg.scene import Scene
from hybridreg.search.hypothesis import Hypothesis
from hybridreg.verdict.confidence import (
    CLEAR,
    DOUBTED,
    LIKELY,
    Word,
    word,
)
from hybridreg.verdict.shared_points import shared_points
from hybridreg.verdict.weighing import Weighed, weigh
from hybridreg.verdict.words import reasons

Array = NDArray[np.float64]


# Nats per point by which a size must be better than those 1.5 % beside it: by hand; 0.09 to 2 on four pairs.
_LEAST_MARGIN = 0.05


@dataclass(frozen=True, eq=False, kw_only=True)
class Judgement:
    """Whether to believe a pose, and why.

    Attributes
    ----------
    verdict : "ok", "doubtful" or "failed"
    confidence : float in [0, 1]
    reasons : tuple of str
    evidence : dict of str to float
        By the names of `hybridreg.evidence.evidence.Evidence`.
    overlay : Overlay
        The whole clouds under the pose, within twice the scene's spacing of one another.
    information : (6, 6) float64
    centre : (3,) float64
        See `hybridreg.evidence.information.Information`.
    rivals : (r, 4, 4) float64
        Poses that explain the data nearly as well, or would be likely were there no better one, best first.
    """

    verdict: Word
    confidence: float
    reasons: tuple[str, ...]
    evidence: dict[str, float]
    overlay: Overlay
    information: Array
    centre: Array
    rivals: Array


def judge(scene: Scene, pose: Pose, matches: Correspondences) -> Judgement:
    """Judge a pose (source to target) by what both clouds say about it.

    The evidence is taken at a resolution of its own (`hybridreg.resolution.default_voxel`), so that it means the
    same whatever voxel the pipeline used. A pose that was not found is judged as what it is, a placeholder: failed.
    """
    weighed = pose.weighed if isinstance(pose.weighed, Weighed) and pose.is_at(pose.weighed.at.T) else None
    weighed = weighed or weigh(scene, pose)
    evidence = replace(
        weighed.evidence, matches_agreeing=float(match_agreement.agreeing(scene, matches, pose.T))
    )
    probability = weighed.confidence if pose.found else 0.0
    twice = shared_points(scene.pair, pose.T, tolerance(scene.pair.source, scene.pair.target).metres)
    explanations = [*scene.explanations, *([twice] if twice else [])]
    if explanations:
        probability = min(probability, DOUBTED)
    why = reasons(
        evidence,
        weighed.at.agreement,
        weighed.at.information,
        weighed.doubts,
        found=pose.found,
        unseen=_unseen(scene),
        explained=bool(explanations),
        started=scene.pair.placed is not None,
        drawn=weighed.drawn,
    )
    return Judgement(
        verdict=word(probability),
        confidence=probability,
        reasons=(*explanations, *why, *_by_bounds(scene, weighed.shut_out)),
        evidence=evidence.as_dict(),
        overlay=Overlay(scene.pair.source.points, scene.pair.target.points, pose.T, 2.0 * scene.spacing),
        information=weighed.at.information.matrix,
        centre=weighed.at.information.centre,
        rivals=_close(weighed),
    )


def of_scale(judgement: Judgement, margin: float) -> Word:
    """The verdict on the source's estimated size: the pose's, and "doubtful" where sizes beside it fit nearly as well,
    by less than a `margin` of nats per point."""
    return "doubtful" if margin < _LEAST_MARGIN and judgement.verdict == "ok" else judgement.verdict


def _by_bounds(scene: Scene, shut_out: list[Hypothesis]) -> list[str]:
    bounds = scene.pair.bounds
    if bounds is None or not shut_out:
        return []
    where = bounds.against(shut_out[0].T)
    return [
        f"the bounds alone tell it from another pose that explains the clouds as well or better: that lies {where}"
    ]


def _unseen(scene: Scene) -> dict[str, str]:
    clouds = {"source": scene.pair.source, "target": scene.pair.target}
    return {name: cloud.seen.words for name, cloud in clouds.items() if cloud.viewpoint is None}


def _close(weighed: Weighed) -> Array:
    # Those that do nearly as well, those that would be likely if the pose were not known, and those that leave it in
    # doubt.
    told, doubted = min(weighed.evidence.support - CLEAR, LIKELY), weighed.doubts.one_place
    told_of = [] if doubted is None else doubted.rivals
    close = [one.T for one in weighed.rivals if one.log_odds > told or one in told_of]
    return np.array(close).reshape(-1, 4, 4)
