# SPDX-License-Identifier: MIT
"""An unlimited supply of seeded pairs of the kinds of input on which the verdict has been wrong.

>>> from hybridreg.data.hard import KINDS, error, sample
>>> pair = sample("map-ground", 3)

Fit on even seeds, measure on odd ones. `python -m hybridreg.data.hard list --seeds 3` shows what the kinds hold.
"""

from hybridreg.data.hard.makers import KINDS, sample
from hybridreg.data.hard.true_poses import Sample, error, is_right

__all__ = ["KINDS", "Sample", "error", "is_right", "sample"]
