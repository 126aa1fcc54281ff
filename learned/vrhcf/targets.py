# SPDX-License-Identifier: MIT
"""Training targets: keypoint pairs of a step from the true pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from hybridreg.learned.vrhcf.batch import SphereBatch, make_batch
from hybridreg.learned.vrhcf.config import SphereNetConfig


@dataclass(frozen=True, kw_only=True)
class SphereTargets:
    """Which descriptors of a batch belong together."""

    target: Tensor  # (g,) int64 rows of the target's patches
    source: Tensor  # (g,) int64 rows of the source's patches

    def to(self, device: torch.device | str) -> SphereTargets:
        """The same targets on another device."""
        return SphereTargets(target=self.target.to(device), source=self.source.to(device))


def pair_keypoints(
    target: npt.NDArray[np.floating],
    source: npt.NDArray[np.floating],
    transform: npt.NDArray[np.floating],
    radius: float,
    count: int,
    rng: np.random.Generator,
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Rows (g,), (g,) of at most ``count`` random points that correspond under the true pose.

    Parameters
    ----------
    target, source
        (M, 3), (N, 3) metres.
    transform
        (4, 4) true ``T_target_source``.
    radius
        Metres: pairs are mutual nearest neighbours closer than this.
    """
    moved = source @ transform[:3, :3].T + transform[:3, 3]
    distance, partner = cKDTree(target).query(moved)
    back = cKDTree(moved).query(target)[1]
    mutual = np.flatnonzero((back[partner] == np.arange(len(moved))) & (distance < radius))
    chosen = np.sort(rng.choice(mutual, min(count, len(mutual)), replace=False))
    return partner[chosen].astype(np.int64), chosen.astype(np.int64)


def training_batch(
    target: npt.NDArray[np.floating],
    source: npt.NDArray[np.floating],
    transform: npt.NDArray[np.floating],
    config: SphereNetConfig,
    seed: int,
    device: torch.device | str = "cpu",
) -> tuple[SphereBatch, SphereTargets]:
    """Patches of ``config.loss_pairs`` true keypoint pairs, or fewer if there are not as many, and which belong
    together.

    Only these keypoints are described: all points of a cloud would cost hundreds of times as much.
    """
    rng = np.random.default_rng(seed)
    rows = pair_keypoints(target, source, transform, config.pair_radius, config.loss_pairs, rng)
    batch = make_batch(target, source, config, keypoints=rows, seed=seed, device=device)
    both = torch.arange(len(rows[0]), device=device)
    return batch, SphereTargets(target=both, source=both)
