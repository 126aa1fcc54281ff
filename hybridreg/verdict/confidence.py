# SPDX-License-Identifier: MIT
"""From evidence to a probability that the pose is right.

A logistic rule on four numbers. Its weights are those of a logistic regression on simulated scenes only (streets,
crossings, yards, woods, rooms and corridors under six kinds of sensor; right poses against half turns, slides, the
best of several random starts, and clouds of different places), rounded: `python -m benchmarks.verdict_weights`.
A later model, calibrated on more data, takes the same evidence.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

Word = Literal["ok", "doubtful", "failed"]

OK, FAILED = 0.95, 0.5
# Per unit of each number; all four are shares between 0 and 1.
WEIGHTS = {"agreement_least": 4.8, "agreement_middle": 0.6, "looked_through": -10.7, "rival_margin": -6.5}
INTERCEPT = -0.9
# A rival that is far behind, or far ahead, says no more than one that is this far. The simulated scenes, divided by
# scene for cross-validation, were told apart best with 0.3 to 0.5.
MARGIN_COUNTS = 0.4

# A rival explains the data nearly as well when its support comes within this of the pose's.
NEARLY = 0.1


def confidence(evidence: Mapping[str, float]) -> float:
    """Probability in (0, 1) that the pose is right."""
    margin = float(np.clip(evidence["rival_margin"], -MARGIN_COUNTS, MARGIN_COUNTS))
    numbers = {**evidence, "rival_margin": margin}
    score = INTERCEPT + sum(weight * numbers[name] for name, weight in WEIGHTS.items())
    # Two poses that explain the data alike share the probability, however well they explain it.
    ceiling = 0.5 + 0.5 * float(np.clip(-margin / NEARLY, 0.0, 1.0))
    return min(float(1.0 / (1.0 + np.exp(-score))), ceiling)


def word(probability: float) -> Word:
    """Verdict of a probability: at least 0.95 is "ok", less than one half is "failed"."""
    return "ok" if probability >= OK else "failed" if probability < FAILED else "doubtful"
