# SPDX-License-Identifier: MIT
"""The evidence in sentences, the most serious first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.agreement import Agreement
from hybridreg.evidence.evidence import Evidence
from hybridreg.evidence.information import Information
from hybridreg.resolution import Tolerance
from hybridreg.verdict.confidence import (
    CLEAR,
    CLOSELY,
    LIKELY,
    SPARSE,
    mostly_through,
    on_one_surface,
    one_sided,
)
from hybridreg.verdict.deformation_words import of_deformed_clouds, three
from hybridreg.verdict.doubts import Doubts
from hybridreg.verdict.one_place import Rivalled

Array = NDArray[np.float64]

# The bounds beyond which a number is worth a sentence; nine in ten right poses of simulated scenes stay within them.
# Share of the visible points that violates free space.
LOOKED_THROUGH = 0.12
# Share of the visible points of an axis that agrees.
AGREEMENT = 0.3
# Smallest eigenvalue of the information per point.
WEAK = 0.02
# Visible share of either cloud.
OVERLAP = 0.15
# Points or cells below which a number tells nothing; by hand.
FEWEST = 60


def reasons(
    evidence: Evidence,
    agreement: Agreement,
    held: Information,
    doubts: Doubts,
    *,
    found: bool,
    unseen: Mapping[str, str],
    explained: bool = False,
    started: bool = False,
    drawn: Tolerance | None = None,
) -> tuple[str, ...]:
    """Why the verdict is what it is; never empty. `unseen` says why the viewpoint of a cloud is unknown.

    `explained`: a sentence before these says why no pose was found; `started`: the search began at a given start;
    `drawn`: degrees and metres by which the surfaces draw the pose to where they fit better.
    """
    if not found:
        instead = "the start" if started else "the identity"
        if explained:
            return (f"no pose is left: {instead} was returned",)
        return (f"no pose was found: the estimator had nothing to work with, and returned {instead}",)
    against = (
        *_elsewhere(drawn),
        *_upside_down(evidence),
        *of_deformed_clouds(evidence, doubts),
        *_with_traffic(doubts.traffic),
        *_with_own_carrier(doubts.own_carrier),
        *_with_one_thing(doubts.one_thing),
        *_against(evidence, agreement, held, doubts.through_walls, drawn),
        *_from_one_side(doubts.lone_thing),
        *_past_its_outline(doubts.seen_past),
        *_in_a_corner(doubts.corner),
        *_from_one_place(doubts.one_place),
        *_inexact(doubts.slack),
        *_unknown(unseen),
    )
    return (*against, _in_favour(evidence)) if against else (_in_favour(evidence),)


def _against(
    evidence: Evidence, agreement: Agreement, held: Information, through_walls: bool, drawn: Tolerance | None
) -> Iterator[str]:
    through = evidence.looked_through
    if through > LOOKED_THROUGH or one_sided(evidence):
        yield (
            f"free space is violated: the sensors saw through {through:.0%} of the points that they should have hit "
            f"({evidence.looked_through_source:.0%} of the source's, "
            f"{evidence.looked_through_target:.0%} of the target's)"
        )
    elif mostly_through(evidence):
        yield (
            f"free space is violated: off the commonest surface {evidence.through_rare:.0f} points are seen through, "
            f"and {evidence.agreed_rare:.0f} agree; is a cloud scaled, stretched or bent?"
        )
    elif through_walls:
        yield f"free space is violated: the scanners saw through {evidence.looked_through_rare:.0%} of the walls"
    if evidence.closely < CLOSELY and drawn is None:
        yield (
            f"the points lie hardly closer to the other cloud's surfaces than by chance ({evidence.closely:.2f} nats a "
            f"point; {CLOSELY} and more where a pose is right)"
        )
    if on_one_surface(evidence):
        yield (
            "nothing agrees but one surface, and it has no relief that tells one place on it from another: the pose "
            "may slide along it"
        )
    k = int(np.argmin(agreement.shares))
    if agreement.shares[k] < AGREEMENT:
        yield _about_axis(agreement, k)
    margin = evidence.rival_margin
    if margin > 0.0:
        yield f"another pose explains the data better (its support is higher by {margin:.2f}; see rivals)"
    elif margin > -CLEAR:
        yield f"another pose explains the data nearly as well (its support is lower by {-margin:.2f}; see rivals)"
    elif evidence.support + margin > LIKELY:
        yield (
            f"another pose is likely by itself (its support is lower by {-margin:.2f}; see rivals): "
            "does the place repeat, or does a cloud hold it twice?"
        )
    if held.weakest < WEAK:
        yield f"the pose is poorly constrained {held.words}: {held.weakest:.1%} of the surfaces' information"
    if evidence.compared < SPARSE:
        yield f"few points: one of the clouds has only {evidence.compared:.0f} that can be compared"
    overlap = max(evidence.visible_source, evidence.visible_target)
    if overlap < OVERLAP:
        yield f"little overlap: neither sensor sees more than {overlap:.0%} of the other's points"


def _elsewhere(drawn: Tolerance | None) -> Iterator[str]:
    if drawn is not None:
        yield (
            f"the surfaces draw the pose {drawn.degrees:.1f} deg and {drawn.metres:.2g} m away, where they fit better; "
            'if it was not refined, refine it: pipeline.swap(refine="gicp") (--set refine=gicp)'
        )


def _upside_down(evidence: Evidence) -> Iterator[str]:
    if evidence.overturned:
        yield (
            "the pose turns the world upside down, or puts a sensor below the other cloud's ground; if a cloud may be "
            'upside down, say so: gravity="unknown" (--gravity unknown); if no sensor stood at its origin, as in a '
            'map: source_viewpoint="none" or target_viewpoint="none" (--source-viewpoint none)'
        )


def _with_traffic(direction: Array | None) -> Iterator[str]:
    if direction is not None:
        yield (
            f"along ({three(direction)}) of the target nothing holds the pose but things no larger than vehicles: if "
            "they drove on between the scans, the pose follows them; check it by odometry, or take scans where walls, "
            "signs or bridges face along the road"
        )


def _with_one_thing(direction: Array | None) -> Iterator[str]:
    if direction is not None:
        yield (
            f"along ({three(direction)}) of the target one thing alone holds the pose, and most of what else faces "
            "that way lies elsewhere: if that thing moved between the scans, the pose follows it; crop it out of both "
            "clouds, or check by another pair"
        )


def _with_own_carrier(metres: float | None) -> Iterator[str]:
    if metres is not None:
        yield (
            f"the pose puts both sensors at one place, and nothing that stands more than {metres:.0f} m away agrees: "
            "if they see the vehicle that carries them, it looks so wherever it drives; leave it out of both clouds, "
            f"points[numpy.linalg.norm(points, axis=1) > {metres:.0f}]"
        )


def _from_one_side(lone_thing: bool) -> Iterator[str]:
    if lone_thing:
        yield (
            "one thing stands alone on flat ground, and by this pose both sensors look at the same side of it; from "
            "behind it may look alike. A rough start excludes that: init=T, max_rotation=90 (--init POSE "
            "--max-rotation 90)"
        )


def _past_its_outline(seen_past: bool) -> Iterator[str]:
    if seen_past:
        yield (
            "one thing stands alone in both views, and its outlines do not coincide: the other sensor saw past some of "
            "its points. A back laid on a front, or on another thing, fits so; keep more of what stands around it, or "
            "add a view from between"
        )


def _in_a_corner(corner: bool) -> Iterator[str]:
    if corner:
        yield (
            "nothing agrees but the walls and the floor of one corner, and other corners look alike; what stands in "
            "it, or both ends of a wall, would tell. A rough start excludes the others: init=T, max_rotation=45 "
            "(--init POSE --max-rotation 45)"
        )


def _from_one_place(rivalled: Rivalled | None) -> Iterator[str]:
    if rivalled is not None:
        rival = rivalled.nearest
        half = f"{0.5 * rival.metres:.1g}"
        bound, option = (
            ("max_rotation=45", "--max-rotation 45")
            if rival.degrees > 90.0
            else (f"max_translation={half}", f"--max-translation {half}")
        )
        yield (
            "by this pose both clouds were seen from nearly one place, and there sensors hit the same spots of any "
            f"place that looks alike; little contradicts another pose, {rival.degrees:.0f} deg and {rival.metres:.2g} "
            f"m away (see rivals): does the place repeat? A start tells which it is: init=T, {bound} (--init POSE "
            f"{option})"
        )


def _inexact(slack: Tolerance | None) -> Iterator[str]:
    if slack is not None:
        how = f"{slack.degrees:.1f} deg or {slack.metres:.2g} m" if np.isfinite(slack).all() else "any length"
        yield f"even where it is right, the surfaces hold the pose too loosely: it may be off by {how}"


def _about_axis(agreement: Agreement, k: int) -> str:
    direction = three(agreement.axes[k])
    looked, agreed = int(agreement.looked[k]), int(agreement.agreed[k])
    if looked < FEWEST:
        return f"only {looked} points visible to both sensors face along ({direction}) of the target, {agreed} agree"
    return f"of {looked} visible points that face along ({direction}) of the target, only {agreed} agree"


def _unknown(unseen: Mapping[str, str]) -> Iterator[str]:
    for name, why in unseen.items():
        yield f"the viewpoint of the {name} is unknown ({why}): free space could not be tested from there"


def _in_favour(evidence: Evidence) -> str:
    cells = int(evidence.relief_cells)
    relief = (
        f"; the ground relief correlates by {evidence.relief_correlation:.2f} over {cells} cells"
        if cells >= FEWEST
        else ""
    )
    return (
        f"of the points visible to the other sensor, {evidence.fitness_visible_source:.0%} of the source's and "
        f"{evidence.fitness_visible_target:.0%} of the target's have a neighbour there; "
        f"{evidence.agreement_least:.0%} or more agree along each axis, "
        f"{evidence.looked_through:.0%} violate free space{relief}"
    )
