# SPDX-License-Identifier: MIT
"""Training examples of OMNet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from hybridreg.learned.omnet import batch as batches
from hybridreg.learned.omnet.batch import OmnetBatch, make_batch
from hybridreg.learned.omnet.config import OmnetConfig
from hybridreg.learned.omnet.targets import OmnetTargets, compute_targets
from hybridreg.learned.true_pair import TruePair


def example(pair: TruePair, config: OmnetConfig, rng: np.random.Generator) -> tuple[OmnetBatch, OmnetTargets]:
    """A sample of a pair's points in its own units, as in the stage, and the true pose in these units.

    Raises
    ------
    ValueError
        As `make_batch`.
    """
    places = (pair.target.centre, pair.source.centre)
    batch, units = make_batch(pair.target.points, pair.source.points, config.points, rng, centres=places)
    return batch, compute_targets(torch.from_numpy(units.normalised(pair.T_target_source)))


def collate(examples: Sequence[tuple[OmnetBatch, OmnetTargets]]) -> tuple[OmnetBatch, OmnetTargets]:
    """Several pairs as one step, which needs at least two."""
    targets = [each for _, each in examples]
    return batches.collate([batch for batch, _ in examples]), OmnetTargets(
        transform=torch.cat([each.transform for each in targets]),
        pose=torch.cat([each.pose for each in targets]),
    )
