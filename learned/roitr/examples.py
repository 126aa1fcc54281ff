# SPDX-License-Identifier: MIT
"""Training examples of RoITr."""

from __future__ import annotations

import numpy as np

from hybridreg.geometry.voxel_cells import voxel_centroids
from hybridreg.learned.roitr.batch import RoitrBatch, make_batch
from hybridreg.learned.roitr.config import RoitrConfig
from hybridreg.learned.roitr.targets import RoitrTargets, compute_targets
from hybridreg.learned.true_pair import TruePair, torch_generator


def example(pair: TruePair, config: RoitrConfig, rng: np.random.Generator) -> tuple[RoitrBatch, RoitrTargets]:
    """Normals and levels of a pair on the network's grid, and one sample of true superpoint pairs.

    Raises
    ------
    ValueError
        As `make_batch`.
    """
    clouds = [voxel_centroids(level.points, config.voxel) for level in (pair.target, pair.source)]
    thinned = [
        points if len(points) <= config.max_points else rng.choice(points, config.max_points, replace=False)
        for points in clouds
    ]
    viewpoints = (pair.target.viewpoint, pair.source.viewpoint)
    batch = make_batch(thinned[0], thinned[1], config, viewpoints=viewpoints)
    return batch, compute_targets(batch, pair.transform, config, torch_generator(rng))
