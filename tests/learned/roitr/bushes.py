# SPDX-License-Identifier: MIT
"""Small pairs with known poses: points anywhere, normals any way, the source a turned copy with a little noise."""

from __future__ import annotations

import numpy as np
import torch

from hybridreg.geometry import se3
from hybridreg.learned.roitr.batch import RoitrBatch
from hybridreg.learned.roitr.config import RoitrConfig
from hybridreg.learned.roitr.point_levels import build_levels


def bush(
    seed: int, config: RoitrConfig, n: int = 160, noise: float = 0.02
) -> tuple[RoitrBatch, torch.Tensor]:
    """A batch and its true pose."""
    rng = np.random.default_rng(seed)
    points, normals = rng.uniform(-3, 3, (n, 3)), rng.normal(size=(n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    truth = se3.from_rt(se3.random_rotation(rng), np.array([1.0, 2.0, 0.0]))
    moved = se3.apply(se3.inverse(truth), points + rng.normal(scale=noise, size=points.shape))
    target = build_levels(points.astype(np.float32), normals.astype(np.float32), config)
    source = build_levels(moved.astype(np.float32), (normals @ truth[:3, :3]).astype(np.float32), config)
    return RoitrBatch(target=target, source=source), torch.from_numpy(truth).float()
