# SPDX-License-Identifier: MIT
"""The quantiles in `hybridreg/verdict/usual.json`, from the rows that the verdict's rules are fitted to.

python -m hybridreg.verdict.training usual --rows runs/evidence.jsonl --write hybridreg/verdict
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.evidence import Evidence
from hybridreg.verdict.usual import FACTS, LEVELS, facts

# Fewer right poses than this tell no hundredth part; by hand.
_FEWEST = 100


def ranges(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What is usual among the right poses of `hybridreg.verdict.training.answers` rows, as `usual.json` holds it.

    Raises
    ------
    ValueError
        Fewer than 100 right poses with one of the facts.
    """
    right = [row for row in rows if row["right"]]
    told = [(facts(Evidence(**row["evidence"]).as_dict()), float(row["weight"])) for row in right]
    found = {}
    for name in FACTS:
        pairs = [(each[name], weight) for each, weight in told if name in each]
        if len(pairs) < _FEWEST:
            raise ValueError(
                f"{len(pairs)} right poses have {name}; {_FEWEST} are needed to tell what is usual: gather more rows"
            )
        values, weights = np.array(pairs).T
        found[name] = [float(f"{value:.4g}") for value in weighted_quantiles(values, weights)]
    return {"poses": len(right), "levels": list(LEVELS), "facts": found}


def weighted_quantiles(values: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values (n,) at `LEVELS`, each counted by its weight (n,), interpolated between neighbours."""
    order = np.argsort(values)
    at = np.cumsum(weights[order]) - 0.5 * weights[order]
    result: NDArray[np.float64] = np.interp(LEVELS, at / weights.sum(), values[order])
    return result
