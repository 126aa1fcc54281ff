# SPDX-License-Identifier: MIT
"""Training examples of SphereNet."""

from __future__ import annotations

import numpy as np

from hybridreg.geometry.voxel_cells import voxel_centroids
from hybridreg.learned.true_pair import TruePair
from hybridreg.learned.vrhcf.batch import SphereBatch
from hybridreg.learned.vrhcf.config import SphereNetConfig
from hybridreg.learned.vrhcf.targets import SphereTargets, training_batch
from hybridreg.learned.vrhcf.upright_frames import place


def example(
    pair: TruePair, config: SphereNetConfig, rng: np.random.Generator
) -> tuple[SphereBatch, SphereTargets]:
    """Patches of some keypoints in the overlap of a pair.

    Raises
    ------
    ValueError
        As `hybridreg.learned.vrhcf.batch.make_batch`; or fewer than two such keypoints: there is nothing to learn from.
    """
    levels = (pair.target, pair.source)
    clouds = [voxel_centroids(level.points, config.voxel) for level in levels]
    # Axes face the origin: with the sensor there, they face the sensor, as in the stage.
    places = [place(level, config.facing) for level in levels]
    truth = pair.T_target_source.copy()
    truth[:3, 3] += truth[:3, :3] @ places[1] - places[0]
    moved = [points - at for points, at in zip(clouds, places, strict=True)]
    batch, targets = training_batch(moved[0], moved[1], truth, config, int(rng.integers(2**31)))
    if len(targets.source) < 2:
        raise ValueError(
            f"{len(targets.source)} keypoints lie within {config.pair_radius:g} m of one in the other cloud; a step "
            "needs two"
        )
    return batch, targets
