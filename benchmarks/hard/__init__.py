# SPDX-License-Identifier: MIT
"""Endless seeded pairs of the kinds of input on which the verdict has been wrong.

>>> from benchmarks.hard import KINDS, error, sample
>>> pair = sample("map-ground", 3)

Fit on even seeds, measure on odd ones. `python -m benchmarks.hard list --seeds 3` shows what the kinds hold.
"""

from benchmarks.hard.makers import KINDS, sample
from benchmarks.hard.truths import Sample, error, is_right

__all__ = ["KINDS", "Sample", "error", "is_right", "sample"]
