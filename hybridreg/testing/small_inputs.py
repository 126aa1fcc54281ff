# SPDX-License-Identifier: MIT
"""Small synthetic inputs for tests of stages."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.matches import Correspondences
from hybridreg.pair import Pair
from hybridreg.scene import Scene

Array = NDArray[np.float64]


def sample_pair(seed: int = 0, n_points: int = 3000) -> tuple[Pair, Array]:
    """A small synthetic scene that two sensors saw in part: the pair, and its true pose (4, 4)."""
    rng = np.random.default_rng(seed)
    world = _courtyard(rng, n_points)
    T = se3.from_rt(se3.rotation_about(np.array([0.02, -0.01, 0.4])), np.array([1.5, -1.0, 0.1]))
    seen_by_source = world[world[:, 0] > -6.0]
    seen_by_target = se3.apply(T, world[world[:, 0] < 9.0])
    noise = [rng.normal(0.0, 0.01, cloud.shape) for cloud in (seen_by_source, seen_by_target)]
    image = rng.integers(0, 255, (72, 128, 3), dtype=np.uint8)
    return Pair.of(seen_by_source + noise[0], seen_by_target + noise[1], image, id=f"courtyard-{seed}"), T


def sample_scene(seed: int = 0) -> tuple[Scene, Array]:
    """`sample_pair` on a grid of 0.4 m."""
    from hybridreg.classical.voxel import VoxelGrid

    pair, T = sample_pair(seed)
    return VoxelGrid(voxel=0.4)(pair), T


def _courtyard(rng: np.random.Generator, n: int) -> Array:
    ground = np.column_stack([rng.uniform(-12, 12, (n, 2)), np.full(n, -1.6)])
    boxes = [ground]
    for _ in range(14):
        centre, size = rng.uniform(-10, 10, 2), rng.uniform(0.6, 4.0, 3)
        face = rng.integers(0, 4, n // 3)
        u, v = rng.uniform(-0.5, 0.5, (2, n // 3))
        side = np.where(face % 2 == 0, 0.5, -0.5)
        x, y = np.where(face < 2, side, u), np.where(face < 2, u, side)
        boxes.append(
            np.column_stack([centre[0] + size[0] * x, centre[1] + size[1] * y, size[2] * (v + 0.5) - 1.6])
        )
    return np.vstack(boxes)


def true_matches(scene: Scene, T: Array, n: int = 120) -> Correspondences:
    """Correct matches in eight groups; one match in five is wrong."""
    rng = np.random.default_rng(0)
    rows = np.sort(rng.choice(len(scene.source), n, replace=False))
    source = scene.source.points[rows]
    target = se3.apply(T, source)
    wrong = rng.random(n) < (0.2 if n > 1 else 0.0)
    target[wrong] += rng.uniform(-8.0, 8.0, (int(wrong.sum()), 3))
    nearest_corner = 4 * (source[:, 0] > 0) + 2 * (source[:, 1] > 0) + (source[:, 2] > -1.0)
    return Correspondences(
        source=source, target=target, weight=np.ones(n), group=nearest_corner.astype(np.int64)
    )
