# SPDX-License-Identifier: MIT
"""Training examples of FCGF."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from hybridreg.learned.fcgf import batch as batches
from hybridreg.learned.fcgf.batch import FcgfBatch, make_batch, noisy
from hybridreg.learned.fcgf.config import FcgfConfig
from hybridreg.learned.fcgf.targets import FcgfTargets, compute_targets
from hybridreg.learned.true_pair import TruePair, torch_generator


def example(pair: TruePair, config: FcgfConfig, rng: np.random.Generator) -> tuple[FcgfBatch, FcgfTargets]:
    """Voxels of a pair, with the published noise on their features, and one sample of anchors and candidates.

    Raises
    ------
    ValueError
        As `make_batch`.
    """
    generator = torch_generator(rng)
    batch = make_batch(pair.target.points, pair.source.points, config)
    targets = compute_targets(batch, pair.transform, config, generator)
    return noisy(batch, generator), targets


def collate(examples: Sequence[tuple[FcgfBatch, FcgfTargets]]) -> tuple[FcgfBatch, FcgfTargets]:
    """Several pairs as one step, as published: statistics and candidates for negatives are then over all of them.

    Anchors and candidates stay those that were drawn pair by pair; the published code draws from the whole batch.
    """
    rows, known, parts = [0, 0], 0, []
    for batch, targets in examples:
        parts.append(
            FcgfTargets(
                positives=targets.positives + torch.tensor(rows, device=targets.positives.device),
                anchors=targets.anchors + known,
                source_candidates=targets.source_candidates + rows[0],
                target_candidates=targets.target_candidates + rows[1],
            )
        )
        rows = [rows[0] + len(batch.source.points), rows[1] + len(batch.target.points)]
        known += len(targets.positives)
    names = ("positives", "anchors", "source_candidates", "target_candidates")
    joined = {name: torch.cat([getattr(part, name) for part in parts]) for name in names}
    return batches.collate([batch for batch, _ in examples]), FcgfTargets(**joined)
