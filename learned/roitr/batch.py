# SPDX-License-Identifier: MIT
"""The input of RoITr: both clouds at every level, with normals. No ground truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch

from hybridreg.geometry.normals import estimate
from hybridreg.learned.roitr.config import RoitrConfig
from hybridreg.learned.roitr.point_levels import Levels, build_levels


@dataclass(frozen=True, kw_only=True)
class RoitrBatch:
    """One pair, ready for the network."""

    target: Levels
    source: Levels

    def to(self, device: torch.device | str) -> RoitrBatch:
        """The same batch on another device."""
        return RoitrBatch(target=self.target.to(device), source=self.source.to(device))


def make_batch(
    target: npt.NDArray[np.floating],
    source: npt.NDArray[np.floating],
    config: RoitrConfig,
    *,
    viewpoints: tuple[npt.NDArray[np.floating] | None, npt.NDArray[np.floating] | None] | None = None,
    device: torch.device | str = "cpu",
) -> RoitrBatch:
    """Normals and levels of a pair.

    Parameters
    ----------
    target, source
        (M, 3), (N, 3) metres, each in its own frame, on the grid that the network was trained with.
    config
        Of the network that will take the batch.
    viewpoints
        Where target and source were seen from: (3,), (k, 3), or None where that is not known (normals then look
        upwards). Used where ``config.facing`` is "sensor"; otherwise, and by default, normals face each frame's
        origin, as in the original (dataset/tdmatch.py).
    device
        Where the tensors are placed; the levels are built on the CPU.

    Raises
    ------
    ValueError
        A cloud of fewer than 4 points, or with values that are not finite.
    """
    origins = (np.zeros(3), np.zeros(3))
    places = origins if viewpoints is None or config.facing == "origin" else viewpoints
    clouds = [
        _levels(cloud, place, config, name)
        for cloud, place, name in zip((target, source), places, ("target", "source"), strict=True)
    ]
    return RoitrBatch(target=clouds[0], source=clouds[1]).to(device)


def _levels(
    cloud: npt.NDArray[np.floating], place: npt.NDArray[np.floating] | None, config: RoitrConfig, name: str
) -> Levels:
    points = np.asarray(cloud, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 4:
        raise ValueError(
            f"{name}: RoITr needs an (N, 3) array of at least 4 points, got shape {points.shape}"
        )
    if not np.isfinite(points).all():
        bad = int((~np.isfinite(points).all(axis=1)).sum())
        raise ValueError(f"{name}: {bad} of {len(points)} points are not finite; drop them first")
    normals = oriented_normals(points, place, config.normal_neighbors)
    return build_levels(points.astype(np.float32), normals.astype(np.float32), config)


def oriented_normals(
    points: npt.NDArray[np.float64], place: npt.NDArray[np.floating] | None, k: int
) -> npt.NDArray[np.float64]:
    """Unit normals (N, 3) that face the sensor; where a neighbourhood gives none, the ray to the sensor is used."""
    normals = estimate(points, None if place is None else np.asarray(place, dtype=np.float64), k)
    none = ~(np.linalg.norm(normals, axis=1) > 0.5)  # not below: NaN counts as none too
    if none.any():
        up = np.array([0.0, 0.0, 1.0])
        rays = np.broadcast_to(up, (int(none.sum()), 3))
        if place is not None:
            away = np.asarray(place, dtype=np.float64).reshape(-1, 3)[0] - points[none]
            length = np.linalg.norm(away, axis=1, keepdims=True)
            rays = np.where(length > 0.0, away / np.maximum(length, 1e-12), up)
        normals = normals.copy()
        normals[none] = rays
    return normals
