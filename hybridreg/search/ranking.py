# SPDX-License-Identifier: MIT
"""Which hypotheses are one, and which of several is the best."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import match_agreement, views
from hybridreg.evidence.log_odds import OK_LOG_ODDS
from hybridreg.geometry import se3
from hybridreg.resolution import Tolerance
from hybridreg.scene import Scene
from hybridreg.search.hypothesis import Hypothesis

Array = NDArray[np.float64]

# Poses nearer than both are one: spacings at the middle of the source; by hand.
_APART = 3.0
# Degrees; by hand.
_TURNED = 5.0
# Log-odds of the best of many starts, roughly settled, below which none of them is right. Of 172 pairs (`sim:val`,
# `sim:train`, hard kinds with even seeds) the right one never had less than -2.8.
HOPELESS = -4.0
# Log-odds from which a pose is beyond doubt: twice those of "ok".
BEYOND_DOUBT = 2.0 * OK_LOG_ODDS
# Log-odds below the best pose's from which closeness no longer decides: by hand.
_CLOSENESS_DECIDES = 8.0


def best(found: Iterable[Hypothesis]) -> list[Hypothesis]:
    """The likeliest first."""
    return sorted(found, key=lambda one: -one.log_odds)


def distinct(scene: Scene, found: Iterable[Hypothesis]) -> list[Hypothesis]:
    """The likeliest first, without those that hardly differ from a likelier one (non-maximum suppression)."""
    both = views.of(scene)
    kept: list[Hypothesis] = []
    for one in best(found):
        centre = se3.apply(one.T, both.middle)[0]
        if all(differs(other.T, one.T, centre, both.spacing) for other in kept):
            kept.append(one)
    return kept


def with_matches(scene: Scene, one: Hypothesis) -> Hypothesis:
    """The same pose by itself: with the share of the matches that agree with it, found once, closer than no other."""
    return one.but(matched=match_agreement.share(scene, one.T), closeness=0.0, found_by=1)


def counted(
    scene: Scene, found: Iterable[Hypothesis], offered: Sequence[Sequence[Hypothesis]]
) -> list[Hypothesis]:
    """The likeliest first, each with the number of entries that `offered` it, its matches and its closeness."""
    both = views.of(scene)

    def told(one: Hypothesis) -> Hypothesis:
        centre = se3.apply(one.T, both.middle)[0]
        came = [
            any(not differs(other.T, one.T, centre, both.spacing) for other in entry) for entry in offered
        ]
        return with_matches(scene, one).but(found_by=max(sum(came), 1))

    return best(told_apart([told(one) for one in found]))


def told_apart(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The same in the same order, with their closeness where it may decide which of them is right."""
    highest = max((one.log_odds for one in found), default=0.0)
    rows = [row for row, one in enumerate(found) if one.log_odds > highest - _CLOSENESS_DECIDES]
    if len(rows) < 2 or highest < HOPELESS:
        return list(found)
    close = {row: found[row].at.closeness for row in rows}
    closest = max(close.values())
    return [one.but(closeness=close.get(row, closest) - closest) for row, one in enumerate(found)]


def differs(rival: Array, T: Array, centre: Array, spacing: float) -> bool:
    """Whether two poses (4, 4) are two answers, seen at `centre` (3,) in the target's frame."""
    off = Tolerance.between(T, rival, centre)
    return off.metres > _APART * spacing or off.degrees > _TURNED
