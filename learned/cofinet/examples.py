# SPDX-License-Identifier: MIT
"""Training examples of CoFiNet."""

from __future__ import annotations

import numpy as np

from hybridreg.learned.cofinet.config import CofinetConfig
from hybridreg.learned.cofinet.targets import CofinetTargets, compute_targets
from hybridreg.learned.cross3dreg.batch import Batch, make_batch
from hybridreg.learned.true_pair import TruePair, torch_generator


def example(pair: TruePair, config: CofinetConfig, rng: np.random.Generator) -> tuple[Batch, CofinetTargets]:
    """The pyramid of a pair, and one draw of true pairs.

    Raises
    ------
    ValueError
        As `make_batch`.
    """
    batch = make_batch(pair.target.points, pair.source.points, config)
    return batch, compute_targets(batch.pyramid, pair.transform, config, torch_generator(rng))
