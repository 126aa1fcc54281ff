# SPDX-License-Identifier: MIT
"""What is usual for right poses: the range of each number that a report shows beside it.

`usual.json` holds quantiles over right poses on simulated training pairs, written by
`python -m hybridreg.verdict.training usual`; no real pair and no test pair took part.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from functools import lru_cache
from importlib.resources import files
from typing import NamedTuple

from hybridreg.evidence.evidence import NO_RIVAL, Evidence
from hybridreg.verdict.words import FEWEST

# The shares of right poses whose numbers are kept.
LEVELS = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
# Whether a larger number speaks for a pose (+1) or against it (-1).
FACTS = {
    "agreement_rare": 1,
    "agreement_least": 1,
    "looked_through": -1,
    "neighbours": 1,
    "overlap": 1,
    "inlier_rmse": -1,
    "weakest": 1,
    "relief_correlation": 1,
    "matched": 1,
    "lead": 1,
}


class Usual(NamedTuple):
    """Quantiles of every fact at `LEVELS`, over `n` right poses."""

    n: int
    quantiles: dict[str, tuple[float, ...]]


@lru_cache(maxsize=1)
def usual() -> Usual:
    """The quantiles in `usual.json`."""
    stored = json.loads(files("hybridreg.verdict").joinpath("usual.json").read_text(encoding="utf-8"))
    return Usual(stored["poses"], {name: tuple(each) for name, each in stored["facts"].items()})


def facts(evidence: Mapping[str, float]) -> dict[str, float]:
    """The numbers of a pose that can be set beside what is usual, by the names in `FACTS`.

    Those that were not measured are left out: relief where the clouds share hardly any ground, matches where no matcher
    ran, the lead where no other pose was found, and all where another judge's evidence has other names.

    Parameters
    ----------
    evidence : what `hybridreg.evidence.evidence.Evidence.as_dict` gives, and `RegistrationResult.evidence` holds
    """
    if not {field.name for field in fields(Evidence)} <= set(evidence):
        return {}
    told = {name: evidence[name] for name in FACTS if name in evidence}
    told["neighbours"] = min(evidence["fitness_visible_source"], evidence["fitness_visible_target"])
    told["overlap"] = max(evidence["visible_source"], evidence["visible_target"])
    told["lead"] = -evidence["rival_margin"]
    measured = {
        "relief_correlation": evidence["relief_cells"] >= FEWEST,
        "matched": evidence["matched"] > 0.0,
        "lead": evidence["rival_margin"] > NO_RIVAL,
    }
    return {name: told[name] for name in FACTS if measured.get(name, True)}
