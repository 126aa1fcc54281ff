# SPDX-License-Identifier: MIT
"""The log-odds that a pose is right, were there no other: a logistic rule on what both clouds say about it."""

from __future__ import annotations

import json
from functools import lru_cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import information
from hybridreg.evidence.agreement import compare_each
from hybridreg.evidence.evidence import Evidence
from hybridreg.evidence.views import Views
from hybridreg.geometry.ground_relief import nats

Array = NDArray[np.float64]

# Probability from which a pose is "ok", by hand, and below which it is "failed": more likely wrong than right.
OK, FAILED = 0.95, 0.5
# Log-odds from which it is "ok".
OK_LOG_ODDS = float(np.log(OK / (1.0 - OK)))
# Information per point below which a direction is open, however little there is: by hand.
_UNHELD = 1e-4
# A share below this is as good as none: by hand.
_NOTHING = 0.02
# Log-odds that a pose loses which turns the world upside down: by hand, as no other evidence makes up for it.
_OVERTURNED = 20.0
# Nats of the relief beyond which it is certain anyway: by hand.
_MOST_NATS = 1000.0
# Points compared at once: as many as fit in a processor's cache, measured.
_AT_ONCE = 20_000


class Model(NamedTuple):
    """A logistic rule: one weight for each of the `terms` of a pose."""

    weights: dict[str, float]
    intercept: float


@lru_cache(maxsize=1)
def model() -> Model:
    """The rule in `log_odds.json`, which `python -m hybridreg.verdict.training fit` fits."""
    stored = json.loads(files("hybridreg.evidence").joinpath("log_odds.json").read_text())
    return Model(stored["weights"], stored["intercept"])


def log_odds(evidence: Evidence) -> float:
    """Log-odds that a pose with this evidence is right, were there no other."""
    weights, intercept = model()
    told = terms(evidence)
    by_terms = intercept + sum(weight * told[name] for name, weight in weights.items())
    return by_terms - _OVERTURNED * evidence.overturned


def terms(evidence: Evidence) -> dict[str, float]:
    """What the rule weighs: shares as they are, quantities without a scale by their logarithm.

    No term tells source from target, so that a pair turned round has the same log-odds.
    """
    relief = float(nats(evidence.relief_cells, evidence.relief_correlation))
    return {
        "agreement_least": evidence.agreement_least,
        "agreement_middle": evidence.agreement_middle,
        "agreement_most": evidence.agreement_most,
        "log_agreement_least": float(np.log(evidence.agreement_least + _NOTHING)),
        "looked_through": evidence.looked_through,
        "looked_through_less": min(evidence.looked_through_source, evidence.looked_through_target),
        "looked_through_rare": evidence.looked_through_rare,
        "log_agreed_rare": float(np.log1p(evidence.agreed_rare)),
        "log_through_rare": float(np.log1p(evidence.through_rare)),
        "relief": float(np.clip(relief, -_MOST_NATS, _MOST_NATS)),
        "log_relief_cells": float(np.log1p(evidence.relief_cells)),
        "log_weakest": float(np.log10(evidence.weakest + _UNHELD)),
        "matched": evidence.matched,
        "closeness": evidence.closeness,
    }


def beside(matched: float, closeness: float = 0.0) -> float:
    """Log-odds that a share of agreeing matches adds, and a closeness below that of another pose (nats) takes away."""
    weights = model().weights
    return weights["matched"] * matched + weights["closeness"] * closeness


def of_each(views: Views, poses: Array, stride: int = 1) -> list[float]:
    """Log-odds of poses (b, 4, 4) by the surfaces alone, from every `stride`-th of the sampled points."""
    some = max(1, _AT_ONCE * stride // max(1, len(views.source.asked) + len(views.target.asked)))
    return [
        log_odds(Evidence.at(agreement, information.measure(agreement, views.target)))
        for first in range(0, len(poses), some)
        for agreement in compare_each(views, poses[first : first + some], stride)
    ]
