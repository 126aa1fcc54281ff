# SPDX-License-Identifier: MIT
"""The verdict on a pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import match_agreement, support, views
from hybridreg.evidence.agreement import Agreement, OneWay
from hybridreg.evidence.information import Information
from hybridreg.evidence.scale import Size, size
from hybridreg.evidence.support import NEARLY
from hybridreg.evidence.surface_distance import closeness
from hybridreg.evidence.views import View
from hybridreg.geometry.fitness import Overlay
from hybridreg.matches import Correspondences, Pose
from hybridreg.scene import Scene
from hybridreg.search import rivals
from hybridreg.search.rivals import Rival
from hybridreg.verdict.confidence import DOUBTED, NO_RIVAL, Word, confidence, word
from hybridreg.verdict.words import reasons

Array = NDArray[np.float64]


# Nats per point by which a size must be better than those 1.5 % beside it: by hand; 0.09 to 2 on four pairs.
_LEAST_MARGIN = 0.05


@dataclass(frozen=True, eq=False, kw_only=True)
class Weighed:
    """What both clouds say about a pose.

    Attributes
    ----------
    agreement : Agreement
    held : Information
    rivals : list of Rival
        Settled, the best supported first.
    evidence : dict of str to float
        Always the same keys, see `evidence_of`.
    confidence : float in (0, 1)
    """

    agreement: Agreement
    held: Information
    rivals: list[Rival]
    evidence: dict[str, float]
    confidence: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Judgement:
    """Whether to believe a pose, and why.

    Attributes
    ----------
    verdict : "ok", "doubtful" or "failed"
    confidence : float in [0, 1]
    reasons : tuple of str
    evidence : dict of str to float
        Always the same keys, see `evidence_of`.
    overlay : Overlay
        The whole clouds under the pose, within twice the scene's spacing of one another.
    information : (6, 6) float64
    centre : (3,) float64
        See `hybridreg.evidence.information.Information`.
    rivals : (r, 4, 4) float64
        Poses that explain the data nearly as well, best first.
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
    """Judge a pose between the levels' frames by what both clouds say about it.

    The evidence is taken at a resolution of its own (`hybridreg.resolution.default_voxel`), so that it means the
    same whatever voxel the pipeline used. A pose that was not found is judged as what it is, a placeholder: failed.
    """
    weighed = weigh(scene, pose)
    evidence = {
        **weighed.evidence,
        "matches_agreeing": float(match_agreement.agreeing(scene, matches, pose.T)),
    }
    probability = weighed.confidence if pose.found else 0.0
    if scene.explanations:
        probability = min(probability, DOUBTED)
    return Judgement(
        verdict=word(probability),
        confidence=probability,
        reasons=(
            *scene.explanations,
            *reasons(evidence, weighed.agreement, weighed.held, found=pose.found, unseen=_unseen(scene)),
        ),
        evidence=evidence,
        overlay=Overlay(scene.pair.source.points, scene.pair.target.points, pose.T, 2.0 * scene.spacing),
        information=weighed.held.matrix,
        centre=weighed.held.centre,
        rivals=_close(weighed.rivals, weighed.evidence["support"]),
    )


def of_scale(judgement: Judgement, margin: float) -> Word:
    """The verdict on the source's estimated size: the pose's, and "doubtful" where sizes beside it fit nearly as well,
    by less than a `margin` of nats per point."""
    return "doubtful" if margin < _LEAST_MARGIN and judgement.verdict == "ok" else judgement.verdict


def weigh(scene: Scene, pose: Pose) -> Weighed:
    """Evidence and confidence of a pose and its rivals, without what only the result needs.

    Computed once for a pose, until another matcher has run: an estimator that weighed its answer spares the verdict
    the work.
    """
    # Rounded, as the pipeline makes the rotation of a pose exact to the last digit.
    key = tuple(np.round([pose.T, *pose.rivals], 9).ravel())
    known = ("weighed", pose.found, pose.recipes, len(scene.matches), key)
    return scene.shared(known, lambda: _weigh(scene, pose))


def _weigh(scene: Scene, pose: Pose) -> Weighed:
    agreement, held = support.seen(scene, pose.T)
    _, target = views.views(scene)
    found = rivals.find(scene, pose.T, agreement, held, pose.rivals) if pose.found else []
    found = [one for one in found if scene.pair.allows(one.T)]
    own = Rival(
        pose.T,
        support.support(support.numbers(agreement, held)),
        pose.recipes,
        match_agreement.share(scene, pose.T),
    )
    own, *found = rivals.told_apart(scene, [own, *found])
    found.sort(key=lambda rival: -rival.support)
    evidence = {
        **evidence_of(agreement, held, own, found, target),
        "closely": closeness(scene, pose.T),
        **_at_another_size(scene, pose),
    }
    return Weighed(
        agreement=agreement, held=held, rivals=found, evidence=evidence, confidence=confidence(evidence)
    )


def _at_another_size(scene: Scene, pose: Pose) -> dict[str, float]:
    scale, gain = size(scene, pose.T) if pose.found else Size()
    return {"scale": scale, "size_gain": gain}


def evidence_of(
    agreement: Agreement, held: Information, own: Rival, found: list[Rival], target: View
) -> dict[str, float]:
    """The numbers behind a verdict; shares lie between 0 and 1.

    agreement_least, _middle, _most : agreeing share of the points that the other sensor looked at, for the axis
        where it is least, the middle one, and the one where it is most
    looked_least : points looked at for the axis with the fewest
    looked_through, looked_through_source, _target : share of those that a sensor looked through; both clouds
        together, and the points of one cloud
    agreement_rare, looked_through_rare : agreeing share, and share looked through, of the points that do not face the
        commonest way (on a field all but the ground); agreed_rare, through_rare : how many these are
    relief_cells, relief_correlation : cells of ground that both clouds show, and how alike their small heights and
        hollows are
    visible_source, visible_target : share of a cloud's points that the other sensor looked at
    hidden_source, hidden_target : share that stood behind something
    fitness_visible_source, fitness_visible_target : share of the visible points with a point near by
    normals : mean cosine between the normals of points and their neighbours
    inlier_rmse : of the agreeing points to the other cloud's planes, metres
    weakest : smallest eigenvalue of the information per point, at most 1/3
    recipes : methods that came to the pose independently of one another
    matched : agreeing share of the matches of that matcher of which most agree; 0 where none ran
    closeness : how much less closely the points lie on the surfaces, to the sensors' noise, than under the rival where
        they do most, nats per point; 0 where they lie most closely, or where no rival comes near
    closely : how closely the points lie on the other cloud's surfaces, to the sensors' noise, nats per point
    scale, size_gain : size at which the source fits better, and by how many nats per point; 1 and 0 where none does
    overturned : 1 where the world is turned over or a sensor stands under the other's ground, else 0
    support : log-odds that the pose is right, were there no other
    rival_margin : how far the best rival's support lies above it (-20 without rivals)
    """
    numbers = support.numbers(agreement, held, own.recipes, own.matched, own.closeness)
    of_pose = support.support(numbers)
    evidence = {
        **numbers,
        "support": of_pose,
        "rival_margin": found[0].support - of_pose if found else NO_RIVAL,
        **_surfaces(agreement.source, target),
    }
    for name, way in (("source", agreement.source), ("target", agreement.target)):
        evidence[f"visible_{name}"] = float(np.mean(way.looked))
        evidence[f"hidden_{name}"] = float(np.mean(way.hidden))
        evidence[f"fitness_visible_{name}"] = support.share(way.covered & way.looked, way.looked)
    return evidence


def _surfaces(way: OneWay, target: View) -> dict[str, float]:
    near, row = way.covered, way.match
    cosine = np.abs(np.sum(way.normals[near] * target.normals[row[near]], axis=1))
    agrees = way.agrees
    across = np.sum((way.moved[agrees] - target.points[row[agrees]]) * target.normals[row[agrees]], axis=1)
    return {
        "normals": float(cosine.mean()) if near.any() else 0.0,
        "inlier_rmse": float(np.sqrt(np.mean(across**2))) if agrees.any() else 0.0,
    }


def _unseen(scene: Scene) -> dict[str, str]:
    clouds = {"source": scene.pair.source, "target": scene.pair.target}
    return {name: cloud.seen.words for name, cloud in clouds.items() if cloud.viewpoint is None}


def _close(found: list[Rival], support: float) -> Array:
    return np.array([rival.T for rival in found if rival.support > support - NEARLY]).reshape(-1, 4, 4)
