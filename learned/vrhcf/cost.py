# SPDX-License-Identifier: MIT
"""Cost of describing keypoints, known before it starts: multiply-adds and memory."""

from __future__ import annotations

from hybridreg.learned.memory_estimate import SLACK
from hybridreg.learned.vrhcf.config import SphereNetConfig

_FLOAT = 4
# Patches processed together: more of them are no faster on a CPU.
CHUNK = 16
# Of the largest layer: input padded twice, unfolded by the convolution, output and norm.
_COPIES = 12


def multiply_adds(config: SphereNetConfig) -> int:
    """Multiply-adds of the convolutions for one keypoint (2.88 G for the published network)."""
    cells = config.azimuth * config.elevation
    total, width, shells = 0, 1, config.radial
    for conv in config.shells:
        shells -= conv.kernel - 1
        total += shells * cells * conv.width * width * conv.kernel**3
        width = conv.width
    for layer in config.surface:
        total += cells * layer.width * width * layer.kernel**2
        width = layer.width
    return total


def forward_bytes(config: SphereNetConfig, keypoints: int) -> int:
    """Estimated peak of describing this many keypoints, in bytes, on top of what the process and the patches hold."""
    cells = config.azimuth * config.elevation
    largest, shells = config.radial, config.radial
    for conv in config.shells:
        shells -= conv.kernel - 1
        largest = max(largest, shells * conv.width)
    largest = max(largest, *(layer.width for layer in config.surface))
    chunk = min(CHUNK, max(1, keypoints))
    # Eight cells of every point: index (int64), weight, and the parts of both.
    spread = config.patch_points * 8 * 40
    return (
        SLACK + chunk * (largest * cells * _FLOAT * _COPIES + spread) + keypoints * config.width * _FLOAT * 2
    )
