# SPDX-License-Identifier: MIT
"""Integer keys, each once: sorted, since `np.unique` of numpy 2.3 and later hashes them first and takes ten times as
long."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]


def distinct_keys(keys: Integers) -> Integers:
    """The different ones among keys (n,), rising."""
    rising = np.sort(keys)
    first = np.ones(len(rising), dtype=np.bool_)
    first[1:] = rising[1:] != rising[:-1]
    return rising[first]
