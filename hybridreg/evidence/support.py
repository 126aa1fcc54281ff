# SPDX-License-Identifier: MIT
"""How far both clouds support one pose, by itself: the log-odds that it is right."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import information, views
from hybridreg.evidence.agreement import FEW, Agreement, compare, compare_each
from hybridreg.evidence.information import Information
from hybridreg.evidence.views import View
from hybridreg.geometry.ground_relief import nats
from hybridreg.scene import Scene

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Probability from which a pose is "ok". A rival explains the data nearly as well when its support is less than the
# log-odds of that below the pose's.
OK = 0.95
NEARLY = float(np.log(OK / (1.0 - OK)))
# Below this no direction is held, and how little it is held says no more.
_UNHELD = 1e-4
# A share below this is as good as none.
_NOTHING = 0.02
# Log-odds that a pose loses which turns the world over: by hand, as no evidence makes up for it.
_OVERTURNED = 20.0
# Points laid on the other cloud at once.
_AT_ONCE = 20_000
# Nats of the relief that are believed at most; beyond all doubt already.
_TOLD = 1000.0


class Model(NamedTuple):
    """A logistic rule: one weight for each of the `terms` of a pose."""

    weights: dict[str, float]
    intercept: float


@lru_cache(maxsize=1)
def model() -> Model:
    """The rule in `support.json`, which `python -m hybridreg.verdict.training.fit` writes."""
    stored = json.loads(files("hybridreg.evidence").joinpath("support.json").read_text())
    return Model(stored["weights"], stored["intercept"])


def support(evidence: Mapping[str, float]) -> float:
    """Log-odds that a pose with this evidence (`numbers`) is right, were there no other pose."""
    weights, intercept = model()
    told = terms(evidence)
    by_terms = intercept + sum(weight * told[name] for name, weight in weights.items())
    return by_terms - _OVERTURNED * evidence["overturned"]


def terms(evidence: Mapping[str, float]) -> dict[str, float]:
    """What the rule weighs: shares as they are, what has no scale or begins at nothing by its logarithm.

    No term tells source from target, so that a pair turned round has the same confidence.
    """
    cells = evidence["relief_cells"]
    relief = float(nats(cells, evidence["relief_correlation"]))
    through = [evidence[f"looked_through_{side}"] for side in ("source", "target")]
    return {
        "agreement_least": evidence["agreement_least"],
        "agreement_middle": evidence["agreement_middle"],
        "agreement_most": evidence["agreement_most"],
        "log_agreement_least": float(np.log(evidence["agreement_least"] + _NOTHING)),
        "looked_through": evidence["looked_through"],
        "looked_through_less": min(through),
        "agreement_rare": evidence["agreement_rare"],
        "looked_through_rare": evidence["looked_through_rare"],
        "log_agreed_rare": float(np.log1p(evidence["agreed_rare"])),
        "log_through_rare": float(np.log1p(evidence["through_rare"])),
        "relief": float(np.clip(relief, -_TOLD, _TOLD)),
        "log_relief_cells": float(np.log1p(cells)),
        "log_weakest": float(np.log10(evidence["weakest"] + _UNHELD)),
        "matched": evidence["matched"],
        "closeness": evidence["closeness"],
    }


def beside(matched: float, closeness: float = 0.0) -> float:
    """What it adds to a pose's support that this share of matches agrees, and that it lies less closely than another
    (nats, at most nought)."""
    weights = model().weights
    return weights["matched"] * matched + weights["closeness"] * closeness


def numbers(
    agreement: Agreement,
    held: Information,
    recipes: int = 1,
    matched: float = 0.0,
    closeness: float = 0.0,
) -> dict[str, float]:
    """What tells of one pose by itself; see `hybridreg.verdict.judgement.evidence_of`."""
    least, middle, most = np.sort(agreement.shares)
    looked, agreed, through = agreement.rare
    found = {
        "agreement_least": least,
        "agreement_middle": middle,
        "agreement_most": most,
        "looked_least": agreement.looked.min(),
        "looked_through": agreement.looked_through,
        "agreement_rare": agreed / (looked + FEW),
        "looked_through_rare": through / (looked + FEW),
        "agreed_rare": agreed,
        "through_rare": through,
        "relief_cells": agreement.relief.cells,
        "relief_correlation": agreement.relief.correlation,
        "weakest": held.weakest,
        "recipes": recipes,
        "matched": matched,
        "closeness": closeness,
        "overturned": agreement.overturned,
    }
    for side, way in (("source", agreement.source), ("target", agreement.target)):
        found[f"looked_through_{side}"] = share(way.free, way.looked)
    return {name: float(value) for name, value in found.items()}


def seen(scene: Scene, T_target_source: Array) -> tuple[Agreement, Information]:
    """What all asked points say about a pose (4, 4), found once a run."""

    def look() -> tuple[Agreement, Information]:
        source, target = views.views(scene)
        agreement = compare(source, target, T_target_source, views.spacing(scene))
        return agreement, information.measure(agreement, target)

    return scene.shared(("verdict", "seen", T_target_source.tobytes()), look)


def share(part: Mask, whole: Mask) -> float:
    """Of the marked points of `whole` (n,), those that `part` (n,) marks; 0 of none."""
    n = int(np.count_nonzero(whole))
    return float(np.count_nonzero(part)) / n if n else 0.0


def of(source: View, target: View, T_target_source: Array, spacing: float, every: int = 1) -> float:
    """Support of a pose (4, 4) by the surfaces alone, from `every` so-many-th of the asked points."""
    return of_each(source, target, T_target_source[None], spacing, every)[0]


def of_each(source: View, target: View, poses: Array, spacing: float, every: int = 1) -> list[float]:
    """The same for poses (b, 4, 4), so many at once that their points fit in a processor's cache."""
    some = max(1, _AT_ONCE * every // max(1, len(source.asked) + len(target.asked)))
    return [
        support(numbers(agreement, information.measure(agreement, target)))
        for first in range(0, len(poses), some)
        for agreement in compare_each(source, target, poses[first : first + some], spacing, every=every)
    ]
