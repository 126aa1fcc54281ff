# SPDX-License-Identifier: MIT
"""Memory estimate of RoITr's forward pass before it runs."""

from __future__ import annotations

from hybridreg.learned.memory_estimate import SLACK
from hybridreg.learned.roitr.batch import RoitrBatch
from hybridreg.learned.roitr.config import RoitrConfig
from hybridreg.learned.roitr.point_levels import Levels

_FLOAT = 4
_GATHERED = 3  # of (neighbours, C) tensors alive at a time: keys or values, their product, one temporary


def forward_bytes(batch: RoitrBatch, config: RoitrConfig) -> int:
    """Estimated peak in bytes, on top of what the process and the batch already hold."""
    clouds = (batch.target, batch.source)
    local = max(_level_bytes(cloud, level, config) for cloud in clouds for level in range(config.levels))
    kept = sum(
        len(points) * width * _FLOAT * 3
        for cloud in clouds
        for points, width in zip(cloud.points, config.widths, strict=True)
    )
    ppf = max(sum(rows.numel() * 4 * 4 * _FLOAT for rows in (*c.neighbors, *c.down)) for c in clouds)
    nodes = [len(cloud.points[-1]) for cloud in clouds]
    transformer = config.transformer
    per_pair = (transformer.hidden_dim + 4 * transformer.heads) * _FLOAT
    attention = sum(n * n for n in nodes) * per_pair + max(nodes) ** 2 * transformer.hidden_dim * _FLOAT
    fine = sum(len(cloud.points[0]) for cloud in clouds) * config.fine_dim * _FLOAT * 2
    return SLACK + max(local, attention) + kept + ppf + fine


def _level_bytes(cloud: Levels, level: int, config: RoitrConfig) -> int:
    return cloud.neighbors[level].numel() * config.inner[level] * _FLOAT * _GATHERED
