# SPDX-License-Identifier: MIT
"""From evidence to a probability that the pose is right.

Either the pose is right, or its best rival is, or none: each by the odds that its own evidence gives it
(`hybridreg.verdict.support`), none by odds of one. So two poses that explain the data alike share the probability,
however well they explain it, and a pose without rivals keeps its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

Word = Literal["ok", "doubtful", "failed"]

OK, FAILED = 0.95, 0.5
# A rival explains the data nearly as well when it alone keeps the pose from "ok": log-odds.
NEARLY = float(np.log(OK / (1.0 - OK)))
# The rival margin where there is no rival to compare with, and the farthest that one counts.
NO_RIVAL = -20.0


def confidence(evidence: Mapping[str, float]) -> float:
    """Probability in (0, 1) that the pose is right, from its `support` and `rival_margin`."""
    margin = max(evidence["rival_margin"], NO_RIVAL)
    against = np.exp([-evidence["support"], margin]).sum()
    return float(1.0 / (1.0 + against))


def word(probability: float) -> Word:
    """Verdict of a probability: at least 0.95 is "ok", less than one half is "failed"."""
    return "ok" if probability >= OK else "failed" if probability < FAILED else "doubtful"
