# SPDX-License-Identifier: MIT
"""Were both clouds seen from one place? There their sensors hit the same spots, of any place that looks alike.

In a hall of columns, one bay on, the pose that puts one sensor where the other stood lets the same beams hit the same
columns: its support is higher than that of the true pose, whose sensors saw the columns from two sides, by up to 8. So
beside such a pose a rival need not explain the clouds nearly as well; it is enough that little contradicts it.
"""

from __future__ import annotations

from typing import NamedTuple

from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.geometry import se3
from hybridreg.resolution import Tolerance
from hybridreg.search.hypothesis import Hypothesis
from hybridreg.verdict.confidence import LIKELY

# Of a rival: points off the commonest surface that agree, at least; those that are seen through, as a share of these
# and of the visible, and of all that are visible, at most; nats per point closer than by chance, at least. By hand: of
# eight real pairs of sensors on one vehicle, poses a few metres aside come near only one or two of these.
_AGREE, _OF_AGREEING, _OF_RARE, _OF_ALL, _CLOSELY = 60, 0.65, 0.15, 0.1, 0.4


class Rivalled(NamedTuple):
    """The `rivals` of such a pose that are likely, or that little contradicts, and how far the nearest of them lies."""

    rivals: list[Hypothesis]
    nearest: Tolerance


def rivalled(at: PoseEvidence, found: list[Hypothesis]) -> Rivalled | None:
    """None where no rival counts, or the pose does not let both clouds be seen from one place."""
    if not at.views.from_one_place(at.T):
        return None
    drawn = at.views.scene.pair.drawn  # of walls drawn through flat scans many poses are likely
    counts = [one for one in found if (one.by_surfaces > LIKELY and not drawn) or _uncontradicted(one.at)]
    if not counts:
        return None
    centre = se3.apply(at.T, at.views.middle)[0]
    nearest = min((Tolerance.between(at.T, one.T, centre) for one in counts), key=lambda off: off.metres)
    return Rivalled(counts, nearest)


def _uncontradicted(at: PoseEvidence) -> bool:
    looked, agreed, through = at.agreement.rare
    return (
        agreed > _AGREE
        and through < min(_OF_AGREEING * agreed, _OF_RARE * looked)
        and at.agreement.looked_through < _OF_ALL
        and at.closeness > _CLOSELY
    )
