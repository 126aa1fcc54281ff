# SPDX-License-Identifier: MIT
"""Made-up pairs of cropped shapes."""

from __future__ import annotations

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from hybridreg.learned.omnet.batch import OmnetBatch


def shapes(n: int, points: int = 120, seed: int = 0) -> tuple[OmnetBatch, torch.Tensor]:
    """Pairs of boxes and blobs in a unit sphere, cropped and turned as the published training does, and (n, 3, 4)."""
    rng = np.random.default_rng(seed)
    sources, targets, poses = [], [], []
    for _ in range(n):
        shape = rng.normal(size=(2 * points, 3)) * rng.uniform(0.2, 1.0, 3)
        shape[: points // 2] = rng.uniform(-1, 1, (points // 2, 3)) * [1.0, 0.1, 0.6] + rng.uniform(
            -0.3, 0.3, 3
        )
        shape /= np.linalg.norm(shape, axis=1).max()
        turn = Rotation.from_euler("XYZ", rng.uniform(0, 45, 3), degrees=True).as_matrix()
        shift = rng.uniform(-0.5, 0.5, 3)
        source, target = (_cropped(shape, points, rng) for _ in range(2))
        sources.append((source - shift) @ turn)
        targets.append(target)
        poses.append(np.column_stack([turn, shift]))
    stacked = [torch.from_numpy(np.stack(part).astype(np.float32)) for part in (sources, targets, poses)]
    return OmnetBatch(source=stacked[0], target=stacked[1]), stacked[2]


def _cropped(shape: np.ndarray, points: int, rng: np.random.Generator) -> np.ndarray:
    along = shape @ rng.normal(size=3)
    return shape[along.argsort()[: int(0.7 * len(shape))]][rng.permutation(int(0.7 * len(shape)))[:points]]
