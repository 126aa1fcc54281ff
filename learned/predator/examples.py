# SPDX-License-Identifier: MIT
"""Training examples of Predator."""

from __future__ import annotations

import numpy as np

from hybridreg.learned.cross3dreg.batch import Batch, make_batch
from hybridreg.learned.predator.config import PredatorConfig
from hybridreg.learned.predator.targets import PredatorTargets, compute_targets
from hybridreg.learned.true_pair import TruePair, torch_generator


def example(
    pair: TruePair, config: PredatorConfig, rng: np.random.Generator
) -> tuple[Batch, PredatorTargets]:
    """The pyramid of a pair, and one draw of true pairs.

    Raises
    ------
    ValueError
        As `make_batch`.
    """
    batch = make_batch(pair.target.points, pair.source.points, config)
    return batch, compute_targets(batch.pyramid, pair.transform, config, torch_generator(rng))
