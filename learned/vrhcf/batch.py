# SPDX-License-Identifier: MIT
"""The input of SphereNet: patches around the keypoints of both clouds. No ground truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from hybridreg.learned.vrhcf.config import SphereNetConfig
from hybridreg.learned.vrhcf.keypoint_patches import build_patches


@dataclass(frozen=True, kw_only=True)
class SphereBatch:
    """One pair, ready for the network. The keypoint is the last row of its patch."""

    target: Tensor  # (m, k, 3) float32, metres, in the cloud's own frame
    source: Tensor  # (n, k, 3)

    def to(self, device: torch.device | str) -> SphereBatch:
        """The same batch on another device."""
        return SphereBatch(target=self.target.to(device), source=self.source.to(device))


def make_batch(
    target: npt.NDArray[np.floating],
    source: npt.NDArray[np.floating],
    config: SphereNetConfig,
    *,
    keypoints: tuple[npt.NDArray[np.integer] | None, npt.NDArray[np.integer] | None] = (None, None),
    seed: int = 0,
    device: torch.device | str = "cpu",
) -> SphereBatch:
    """Cut the patches of a pair.

    Parameters
    ----------
    target, source
        (M, 3), (N, 3) metres, each in its sensor's frame: the axes of patches face its origin.
    config
        Of the network that will take the batch.
    keypoints
        Rows of target and source to be described; None for all.
    seed
        Of the sampling of points in patches that have more than needed.
    device
        Where the tensors are placed; patches are cut on the CPU.

    Raises
    ------
    ValueError
        A cloud without points, or with values that are not finite.
    """
    cut = [
        _cut(cloud, rows, config, seed, name)
        for cloud, rows, name in zip((target, source), keypoints, ("target", "source"), strict=True)
    ]
    return SphereBatch(target=cut[0], source=cut[1]).to(device)


def _cut(
    cloud: npt.NDArray[np.floating],
    rows: npt.NDArray[np.integer] | None,
    config: SphereNetConfig,
    seed: int,
    name: str,
) -> Tensor:
    points = np.ascontiguousarray(cloud, dtype=np.float32)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0:
        raise ValueError(f"{name}: SphereNet needs an (N, 3) array of points, got shape {points.shape}")
    bad = int((~np.isfinite(points).all(axis=1)).sum())
    if bad:
        raise ValueError(f"{name}: {bad} of {len(points)} points are not finite; drop them first")
    chosen = np.arange(len(points)) if rows is None else np.asarray(rows, dtype=np.int64)
    rng = np.random.default_rng(seed)
    return torch.from_numpy(build_patches(points, chosen, config.radius, config.patch_points, rng))
