# SPDX-License-Identifier: MIT
"""Memory estimate of a network on stacked clouds before it runs (Predator, CoFiNet)."""

from __future__ import annotations

from hybridreg.learned.kpfcnn.kpfcnn_config import KpfcnnConfig
from hybridreg.learned.memory_estimate import SLACK, stage_bytes
from hybridreg.learned.pyramid.point_pyramid import Pyramid

_FLOAT = 4


def encoder_bytes(pyramid: Pyramid, config: KpfcnnConfig, heads: int) -> int:
    """Estimated peak of a forward pass in bytes.

    The skips are kept; in addition either a stage of the encoder or decoder is active, or the ``heads`` between them,
    with this number of bytes.
    """
    stages = range(pyramid.stages)
    skips = sum(len(pyramid.points[stage]) * config.skip_dims[stage] * _FLOAT for stage in stages)
    working = max(stage_bytes(pyramid, stage, config.skip_dims[stage]) for stage in stages)
    return SLACK + skips + max(working, heads)
