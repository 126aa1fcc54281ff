# SPDX-License-Identifier: MIT
"""Four small pairs that a network can learn by heart."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import torch
from streets import moved, street, yaw

from hybridreg.learned.cross3dreg.batch import Batch, make_batch


class Learned(NamedTuple):
    """A pair and its true pose."""

    batch: Batch
    transform: torch.Tensor  # (4, 4)


def four_pairs(config: Any, points: int = 1200, extent: float = 12.0) -> list[Learned]:
    """Two overlapping parts of each of four streets, turned against each other."""
    found = []
    for seed in range(4):
        truth = yaw(20.0 + 25.0 * seed, (1.0, -0.5 * seed, 0.1))
        scene = street(seed, points, extent)
        target, source = scene[scene[:, 0] < 6.0], scene[scene[:, 0] > -6.0]
        batch = make_batch(target, moved(source, np.linalg.inv(truth)), config)
        found.append(Learned(batch, torch.from_numpy(truth).float()))
    return found
