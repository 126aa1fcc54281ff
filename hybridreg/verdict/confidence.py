# SPDX-License-Identifier: MIT
"""From evidence to a probability that the pose is right.

Boosted trees on the pose's evidence, its support among it, and on how its best rival does beside it; see
`hybridreg.verdict.training.fit`, which fits them. Whatever speaks for the pose can only raise the probability, whatever
speaks against it, its best rival included, can only lower it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from typing import Literal

import numpy as np

from hybridreg.evidence.evidence import NO_RIVAL, Evidence
from hybridreg.evidence.log_odds import FAILED, OK, OK_LOG_ODDS
from hybridreg.geometry.ground_relief import TELLS, nats
from hybridreg.verdict.boosted import Boosted

Word = Literal["ok", "doubtful", "failed"]

# Probability of a pose that turns the world upside down, at most: by hand.
_OVERTURNED = 0.3
# Probability of a pose that some rule leaves in doubt (docs/methods.md 12.7), at most: by hand.
DOUBTED = 0.9
# Nats per point from which it fits better at another scale: of some 400 right training poses none gained 0.08.
SIZE_GAIN = 0.12
# Points that agree off the commonest surface before a pose is "ok", where its relief does not tell or the clouds are
# sparse: chance makes a handful agree.
SPARSE, _AGREE = 1000, 20
# Nats per point by which the points lie closer to the surfaces than by chance, from which a pose is "ok": by hand. Of
# 426 right poses (real, `sim:val`, hard kinds with even seeds) none has less than 0.41; a slice a metre thick that was
# tilted by 7 degrees has 0.36.
CLOSELY = 0.4
# Points off the commonest surface that are seen through, from which it is no chance that more are than agree; by hand.
# Of 279 right poses on `sim:val`, refined or not, none has more than half as many. Where the source is stretched, or of
# another size, the ground's relief may still agree, and nothing else does.
_THROUGH = 20
# Share of either cloud's visible points that the other sensor saw through, above which a pose is not "ok": by hand. Of
# some 190 right poses that would be (real, `sim:val`, hard kinds with even seeds, made halls in which everything moved)
# one has more; wrong ones of few points, or that follow a thing which moved, have 0.2 to 0.5.
ONE_SIDED = 0.2
# Log-odds by which the best rival must lie behind for an "ok": its own are no surer than the pose's. By hand: of made
# halls, racks, tunnels and pipes that repeat exactly, six wrong poses led by 3.7 to 4.4; of 68 pairs of `sim:val` and
# hard kinds with even seeds, two right ones lead by 3.5 to 4.5.
CLEAR = 4.5
# Agreeing share of the middle axis below which the pose is not "ok" where so many points face the rarest; by hand. Of
# some 30 right poses on fields and in maps (`sim:val/degenerate`, hard kinds with even seeds) 0.39 or more of the
# points agree that do not face the commonest axis; of a wrong one on made relief, half a turn off, 0.01.
_HARDLY, _FACING = 0.1, 60
# Agreeing share of all that does not face the commonest axis below which the relief alone makes no "ok" where some
# points face the rarest; by hand. Of 99 right poses that relief speaks for (real, `sim:val`, hard kinds with even
# seeds, with and without viewpoints) none has less than 0.33; of nine wrong ones, on ground whose waves repeat, none
# more than 0.22.
_FEW, _SOME = 0.25, 30
# Log-odds by which a rival may be likelier and still count as equal; by hand.
EQUAL = 1.0
# Log-odds from which a rival is told of, however far it lies behind: a map may hold a place twice.
LIKELY = 0.0
# Evidence that speaks for a pose the larger it is (+1), or against it (-1); 0 may do either.
SPEAKS = {
    "agreement_least": 1,
    "agreement_middle": 1,
    "agreement_most": 1,
    "looked_least": 0,
    "looked_through": -1,
    "looked_through_less": -1,
    "looked_through_more": -1,
    "agreement_rare": 1,
    "looked_through_rare": -1,
    "agreed_rare": 1,
    "through_rare": -1,
    "relief_cells": 0,
    "relief_correlation": 1,
    "weakest": 1,
    "matched": 1,
    "found_by": 1,
    "compared": 0,
    "visible_less": 0,
    "visible_more": 0,
    "fitness_visible_less": 1,
    "fitness_visible_more": 1,
    "closely": 1,
    "size_gain": -1,
    "support": 1,
    "rival_margin": -1,
}
# Evidence of one cloud each, told as the less and the more of both: a pair turned round has the same confidence.
_BOTH = ("looked_through", "visible", "fitness_visible")


def confidence(evidence: Evidence, rule: Boosted | None = None) -> float:
    """Probability in (0, 1) that the pose with this evidence is right.

    By other trees than the shipped ones where a `rule` is given.
    """
    rule = rule or trees()
    told = features(evidence)
    probability = believed(rule(told), told["rival_margin"])
    if probability < FAILED and (_one_of_two(told, rule) or _supported(evidence)):
        probability = FAILED
    if evidence.overturned:
        return min(probability, _OVERTURNED)
    resized, close = told["size_gain"] > SIZE_GAIN, told["rival_margin"] > -CLEAR
    bounded = resized or close or on_one_surface(evidence) or evidence.closely < CLOSELY
    bounded = bounded or mostly_through(evidence) or _but_for_the_ground(evidence) or one_sided(evidence)
    return min(probability, DOUBTED) if bounded else probability


def _supported(evidence: Evidence) -> bool:
    # Sure by the support, and no rival does better. Of 28 poses that the trees alone call "failed" (hard kinds, seeds
    # 420 to 452, and `building-485`) four have a support of 1.8 or more; three are right, and one has a better rival.
    return evidence.support >= OK_LOG_ODDS and evidence.rival_margin < 0.0


def on_one_surface(evidence: Evidence) -> bool:
    """Whether nothing but the commonest surface agrees, and that has no relief to tell one place on it from another."""
    return evidence.agreed_rare < _AGREE and (evidence.compared < SPARSE or not _relief_tells(evidence))


def _relief_tells(evidence: Evidence) -> bool:
    return float(nats(evidence.relief_cells, evidence.relief_correlation)) > TELLS


def _but_for_the_ground(evidence: Evidence) -> bool:
    # Both rarer axes contradict the pose, and only the ground agrees, with its relief: that may repeat.
    if evidence.looked_least > _FACING and evidence.agreement_middle < _HARDLY:
        return True
    return _relief_tells(evidence) and evidence.looked_least > _SOME and evidence.agreement_rare < _FEW


def mostly_through(evidence: Evidence) -> bool:
    """Whether of the points that do not face the commonest axis more are seen through than agree."""
    return evidence.through_rare > max(_THROUGH, evidence.agreed_rare)


def one_sided(evidence: Evidence) -> bool:
    """Whether one of the clouds is seen through by much, whatever the other is."""
    return max(evidence.looked_through_source, evidence.looked_through_target) > ONE_SIDED


def _one_of_two(told: Mapping[str, float], rule: Boosted) -> bool:
    # "ok" were it not for a rival that explains the clouds about as well: one of the two is right (of 103 such
    # training poses 37 were).
    alone = rule({**told, "rival_margin": NO_RIVAL})
    return told["rival_margin"] < EQUAL and alone >= OK_LOG_ODDS


def believed(log_odds: float, rival_margin: float) -> float:
    """Probability by the trees, but no more than the pose's share between itself and its best rival: of two that
    explain the data equally well at most one is right."""
    return float(1.0 / (1.0 + np.exp(max(-log_odds, rival_margin))))


@lru_cache(maxsize=1)
def trees() -> Boosted:
    """The trees in `confidence.json`, which `python -m hybridreg.verdict.training.fit` writes."""
    return Boosted.read(json.loads(files("hybridreg.verdict").joinpath("confidence.json").read_text()))


def features(evidence: Evidence) -> dict[str, float]:
    """What the trees ask about, by the names in `SPEAKS`."""
    facts = evidence.as_dict()
    told = {name: facts[name] for name in SPEAKS if name in facts}
    for name in _BOTH:
        sides = (facts[f"{name}_source"], facts[f"{name}_target"])
        told |= {f"{name}_less": min(sides), f"{name}_more": max(sides)}
    return {**told, "rival_margin": max(evidence.rival_margin, NO_RIVAL)}


def word(probability: float) -> Word:
    """Verdict of a probability: at least 0.95 is "ok", less than one half is "failed"."""
    return "ok" if probability >= OK else "failed" if probability < FAILED else "doubtful"
