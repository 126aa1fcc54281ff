# SPDX-License-Identifier: MIT
"""A pair of clouds with its true pose, from which a network's training examples are made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from hybridreg.scene import Level

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class TruePair:
    """Clouds in their own frames, metres, each with its viewpoint. They are not voxelised: spacing 0."""

    target: Level
    source: Level
    T_target_source: Array  # (4, 4)

    @staticmethod
    def of(
        target: Array, source: Array, truth: Array, places: tuple[Array | None, Array | None] = (None, None)
    ) -> TruePair:
        """From points (M, 3), (N, 3), the true pose (4, 4), and the viewpoints of target and source."""
        levels = [
            Level(points=points, spacing=0.0, viewpoint=place)
            for points, place in zip((target, source), places, strict=True)
        ]
        return TruePair(target=levels[0], source=levels[1], T_target_source=truth)

    def scaled(self, factor: float) -> TruePair:
        """Everything scaled by a factor."""
        levels = [
            Level(
                points=level.points * factor,
                spacing=0.0,
                viewpoint=None if level.viewpoint is None else level.viewpoint * factor,
            )
            for level in (self.target, self.source)
        ]
        truth = self.T_target_source.copy()
        truth[:3, 3] *= factor
        return TruePair(target=levels[0], source=levels[1], T_target_source=truth)

    def moved(self, motions: tuple[Array, Array], jitter: float, rng: np.random.Generator) -> TruePair:
        """Each cloud, target first, moved with its viewpoint; noise of half-width ``jitter``."""
        levels = [
            Level(
                points=_moved(level.points, T) + rng.uniform(-jitter, jitter, level.points.shape),
                spacing=0.0,
                viewpoint=None if level.viewpoint is None else _moved(level.viewpoint, T),
            )
            for level, T in zip((self.target, self.source), motions, strict=True)
        ]
        truth = motions[0] @ self.T_target_source @ np.linalg.inv(motions[1])
        return TruePair(target=levels[0], source=levels[1], T_target_source=truth)

    @property
    def transform(self) -> torch.Tensor:
        """The true pose (4, 4), float32."""
        return torch.from_numpy(self.T_target_source).float()


def torch_generator(rng: np.random.Generator) -> torch.Generator:
    """A torch generator seeded from a numpy generator."""
    return torch.Generator().manual_seed(int(rng.integers(2**62)))


def _moved(points: Array, T: Array) -> Array:
    moved: Array = points @ T[:3, :3].T + T[:3, 3]
    return moved
