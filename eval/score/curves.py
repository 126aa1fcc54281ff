# SPDX-License-Identifier: MIT
"""Recall as one threshold varies and the other stays fixed."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.eval.score.errors import Errors
from hybridreg.eval.score.protocols import Protocol

Array = NDArray[np.float64]


class Curve(NamedTuple):
    """Recall (k,) at thresholds (k,)."""

    threshold: Array
    recall: Array


def sweep(errors: Errors, protocol: Protocol, which: Literal["rre", "rte"], n: int = 101) -> Curve:
    """Recall against one threshold, from zero to five times the protocol's; the other stays at its own."""
    widest = 5.0 * (protocol.rre_deg if which == "rre" else protocol.rte_m)
    thresholds = np.linspace(0.0, widest, n)
    if which == "rre":
        recall = [float(errors.within(t, protocol.rte_m).mean()) for t in thresholds]
    else:
        recall = [float(errors.within(protocol.rre_deg, t).mean()) for t in thresholds]
    return Curve(thresholds, np.array(recall))
