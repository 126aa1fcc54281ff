# SPDX-License-Identifier: MIT
"""The verdict on a pose."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import match_agreement, one_surface
from hybridreg.evidence.agreement import Agreement, OneWay
from hybridreg.evidence.deformation.scale import Size
from hybridreg.evidence.evidence import NO_RIVAL, Evidence, share
from hybridreg.evidence.log_odds import FAILED, OK, OK_LOG_ODDS, log_odds
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.evidence.views import View
from hybridreg.geometry import se3
from hybridreg.geometry.fitness import Overlay
from hybridreg.matches import Correspondences, Pose
from hybridreg.resolution import Tolerance, tolerance
from hybridreg.scene import Scene
from hybridreg.search import rivals, settle
from hybridreg.search.hypothesis import Hypothesis, of_pose
from hybridreg.search.ranking import best, differs, told_apart
from hybridreg.verdict.confidence import CLEAR, CLOSELY, DOUBTED, LIKELY, ONE_SIDED, Word, confidence, word
from hybridreg.verdict.doubts import Doubts, is_right_but_for_size
from hybridreg.verdict.words import reasons

Array = NDArray[np.float64]


# Nats per point by which a size must be better than those 1.5 % beside it: by hand; 0.09 to 2 on four pairs.
_LEAST_MARGIN = 0.05


@dataclass(frozen=True, eq=False, kw_only=True)
class Weighed:
    """What both clouds say about a pose and its rivals.

    Attributes
    ----------
    at : PoseEvidence
    rivals : list of Hypothesis
        Settled, the likeliest first.
    evidence : Evidence
    doubts : Doubts
    drawn : Tolerance or None
        How far away the surfaces draw the pose to where they fit better, where that decides: beyond the tolerance of
        one that would be "ok", within it of one that would have failed.
    confidence : float in (0, 1)
    undeformed : float in (0, 1)
        What it would be if no deformation of the source were found. No search finds a better pose then.
    """

    at: PoseEvidence
    rivals: list[Hypothesis]
    evidence: Evidence
    doubts: Doubts
    drawn: Tolerance | None
    confidence: float
    undeformed: float


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
    if scene.explanations:
        probability = min(probability, DOUBTED)
    why = reasons(
        evidence,
        weighed.at.agreement,
        weighed.at.information,
        weighed.doubts,
        found=pose.found,
        unseen=_unseen(scene),
        explained=bool(scene.explanations),
        started=scene.pair.placed is not None,
        drawn=weighed.drawn,
    )
    return Judgement(
        verdict=word(probability),
        confidence=probability,
        reasons=(*scene.explanations, *why),
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


def weigh(scene: Scene, pose: Pose) -> Weighed:
    """Evidence and confidence of a pose and its rivals, without what only the result needs."""
    at = of_pose(scene, pose)
    own = _alone(scene, at, pose.found_by)
    offered = rivals.find(scene, own, pose) if pose.found else []
    own, *found = told_apart([own, *(one for one in offered if scene.pair.allows(one.T))])
    found = best(found)
    evidence = evidence_of(own, found, at.size if pose.found else Size())
    believed, doubts = _believed(scene, at, found, evidence)
    probability = min(believed, DOUBTED) if doubts else believed
    drawn, loose = None, doubts.about_source or evidence.closely < CLOSELY
    if pose.found and not evidence.overturned and (loose or not FAILED <= probability <= DOUBTED):
        drawn = _drawn(scene, at, found, ok=probability > DOUBTED)
    if drawn and probability > DOUBTED:
        probability = DOUBTED
    elif drawn:  # to a pose that no deformation betters
        probability, doubts = max(probability, FAILED), doubts.of_pose()
    return Weighed(
        at=at,
        rivals=found,
        evidence=evidence,
        doubts=doubts,
        drawn=drawn,
        confidence=probability,
        undeformed=_undeformed(evidence) if doubts.about_source and not doubts.about_pose else probability,
    )


def _believed(
    scene: Scene, at: PoseEvidence, found: list[Hypothesis], evidence: Evidence
) -> tuple[float, Doubts]:
    # The probability by the trees, and what they do not see.
    probability = confidence(evidence)
    if probability < FAILED and (is_right_but_for_size(scene, at, evidence) or _is_held(scene, at, evidence)):
        probability = FAILED
    return probability, Doubts.about(scene, at, found, evidence, likely=probability >= FAILED)


def _is_held(scene: Scene, at: PoseEvidence, evidence: Evidence) -> bool:
    return one_surface.holds(at, evidence, tolerance(scene.pair.source, scene.pair.target).metres)


def _undeformed(evidence: Evidence) -> float:
    # A source that is not deformed lies closely, and neither cloud is seen through by much.
    source, target = (
        min(part, ONE_SIDED) for part in (evidence.looked_through_source, evidence.looked_through_target)
    )
    closely = max(evidence.closely, CLOSELY)
    return confidence(
        replace(evidence, closely=closely, looked_through_source=source, looked_through_target=target)
    )


def _alone(scene: Scene, at: PoseEvidence, found_by: int = 1) -> Hypothesis:
    matched = match_agreement.share(scene, at.T)
    return Hypothesis(at=at, by_surfaces=at.by_surfaces, found_by=found_by, matched=matched)


def _drawn(scene: Scene, at: PoseEvidence, found: list[Hypothesis], *, ok: bool) -> Tolerance | None:
    # Degrees and metres by which the surfaces draw a pose, most likely one that nobody refined, to where they fit
    # better: one that would be "ok" beyond the tolerance, or one that would have failed to a pose within it that is
    # "ok". Of some 800 poses of RANSAC and LGR on `sim:val`, with and without GICP, 16 that would be "ok" were wrong,
    # of which 15 are drawn so; 14 that would have failed were right, of which nine are.
    allowed = tolerance(scene.pair.source, scene.pair.target)
    centre = se3.apply(at.T, at.views.middle)[0]
    for T in settle.at_rest(at.views, at.T):
        rest, off = PoseEvidence(at.views, T), Tolerance.between(at.T, T, centre)
        better = off.within(allowed) != ok and rest.by_surfaces > at.by_surfaces
        if better and (ok or _is_ok(scene, rest, found)):
            return off
    return None


def _is_ok(scene: Scene, at: PoseEvidence, found: list[Hypothesis]) -> bool:
    # Beside those rivals that differ from it too. One that is not likely by its surfaces alone need not be weighed.
    if at.by_surfaces < OK_LOG_ODDS:
        return False
    centre, spacing = se3.apply(at.T, at.views.middle)[0], at.views.spacing
    apart = [one.but(closeness=0.0) for one in found if differs(one.T, at.T, centre, spacing)]
    own, *others = told_apart([_alone(scene, at), *apart])
    evidence = evidence_of(own, best(others), at.size)
    probability, doubts = _believed(scene, at, others, evidence)
    return probability >= OK and not doubts


def evidence_of(own: Hypothesis, found: list[Hypothesis], size: Size) -> Evidence:
    """All facts about a hypothesis beside its rivals, the likeliest of these first."""
    agreement = own.at.agreement
    evidence = Evidence.at(agreement, own.at.information, own.found_by, own.matched, own.closeness)
    support = log_odds(evidence)
    cosine, rmse = _surfaces(agreement.source, own.at.views.target)
    (looked, hidden, covered), (looked_back, hidden_back, covered_back) = _seen(agreement)
    return replace(
        evidence,
        support=support,
        rival_margin=found[0].log_odds - support if found else NO_RIVAL,
        normals=cosine,
        inlier_rmse=rmse,
        compared=float(min(len(view.asked) for view in (own.at.views.source, own.at.views.target))),
        visible_source=looked,
        visible_target=looked_back,
        hidden_source=hidden,
        hidden_target=hidden_back,
        fitness_visible_source=covered,
        fitness_visible_target=covered_back,
        closely=own.at.closeness,
        scale=size.scale,
        size_gain=size.gain,
    )


def _seen(agreement: Agreement) -> list[tuple[float, float, float]]:
    # Of source and target: shares looked at and hidden, and of those looked at the share with a point near by.
    return [
        (float(np.mean(way.looked)), float(np.mean(way.hidden)), share(way.covered & way.looked, way.looked))
        for way in (agreement.source, agreement.target)
    ]


def _surfaces(way: OneWay, target: View) -> tuple[float, float]:
    # Mean cosine between the normals of neighbours, and root mean square distance to the planes, metres.
    near, row = way.covered, way.match
    cosine = np.abs(np.sum(way.normals[near] * target.normals[row[near]], axis=1))
    agrees = way.agrees
    across = np.sum((way.moved[agrees] - target.points[row[agrees]]) * target.normals[row[agrees]], axis=1)
    return (
        float(cosine.mean()) if near.any() else 0.0,
        float(np.sqrt(np.mean(across**2))) if agrees.any() else 0.0,
    )


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
