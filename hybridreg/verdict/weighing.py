# SPDX-License-Identifier: MIT
"""Evidence and confidence of a pose beside its rivals."""

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
from hybridreg.matches import Pose
from hybridreg.resolution import Tolerance, tolerance
from hybridreg.scene import Scene
from hybridreg.search import rivals, settle
from hybridreg.search.hypothesis import Hypothesis, of_pose
from hybridreg.search.ranking import best, differs, told_apart
from hybridreg.verdict.confidence import (
    CLEAR,
    CLOSELY,
    DOUBTED,
    EQUAL,
    ONE_SIDED,
    confidence,
)
from hybridreg.verdict.doubts import Doubts, is_right_but_for_size

Array = NDArray[np.float64]


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
    shut_out : list of Hypothesis
        Rivals beyond the pair's bounds that do about as well, the likeliest first: the bounds alone tell them apart.
    """

    at: PoseEvidence
    rivals: list[Hypothesis]
    evidence: Evidence
    doubts: Doubts
    drawn: Tolerance | None
    confidence: float
    undeformed: float
    shut_out: list[Hypothesis]


def weigh(scene: Scene, pose: Pose) -> Weighed:
    """Evidence and confidence of a pose and its rivals, without what only the result needs."""
    at = of_pose(scene, pose)
    own = _alone(scene, at, pose.found_by)
    offered = rivals.find(scene, own, pose) if pose.found else []
    shut_out = _as_good(own, [one for one in offered if not scene.pair.allows(one.T)])
    own, *found = told_apart([own, *(one for one in offered if scene.pair.allows(one.T))])
    found = best(found)
    evidence = evidence_of(own, found, at.size if pose.found else Size())
    believed, doubts = _believed(scene, at, found, evidence)
    likelier_beyond = bool(shut_out) and shut_out[0].log_odds > own.log_odds + EQUAL
    probability = min(believed, DOUBTED) if doubts or likelier_beyond else believed
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
        shut_out=shut_out,
    )


def _as_good(own: Hypothesis, others: list[Hypothesis]) -> list[Hypothesis]:
    # Those that would leave the pose in doubt, were they allowed.
    if not others:
        return []
    own, *found = told_apart([own, *others])
    return [one for one in best(found) if one.log_odds > own.log_odds - CLEAR]


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
