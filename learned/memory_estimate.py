# SPDX-License-Identifier: MIT
"""Memory estimate of a forward pass before it runs: too much is refused instead of being killed."""

from __future__ import annotations

import os

import torch

from hybridreg.learned.cross3dreg.config import NetworkConfig
from hybridreg.learned.pyramid.point_pyramid import Pyramid

_FLOAT = 4
_LINK = (
    84  # bytes a link: two indices, offset and length, and the tenth of the kernel points that it influences
)
_COPIES = 4  # of a stage's widest features alive at a time: input, output, and the steps between
SLACK = 2**26  # heap overhead on top of what is in use: 10 to 80 MB for the same pass


def forward_bytes(pyramid: Pyramid, config: NetworkConfig) -> int:
    """Estimated peak of a forward pass in bytes, on top of what the process and the batch already hold."""
    stages = range(pyramid.stages)
    width = config.backbone.init_dim * 2
    encoder = max(stage_bytes(pyramid, stage, width * 2**stage) for stage in stages)
    skips = sum(len(pyramid.points[stage]) * width * 2**stage * _FLOAT for stage in stages)
    return SLACK + max(encoder, _attention_bytes(pyramid, config)) + skips


def stage_bytes(pyramid: Pyramid, stage: int, width: int) -> int:
    """Estimated bytes in use while a stage, counted from 0, computes features of a width."""
    links = int((pyramid.neighbors[stage] < len(pyramid.points[stage])).sum())
    return links * _LINK + len(pyramid.points[stage]) * width * _FLOAT * _COPIES


def _attention_bytes(pyramid: Pyramid, config: NetworkConfig) -> int:
    # The structure embedding of both clouds, its parts again while they are concatenated, and the scores.
    counts = [min(n, config.matching.max_superpoints) for n in pyramid.lengths[-1]]
    transformer = config.transformer
    per_pair = (transformer.hidden_dim + 3 * transformer.heads) * _FLOAT
    return sum(n * n for n in counts) * per_pair + max(counts) ** 2 * transformer.hidden_dim * _FLOAT


def available_bytes(device: torch.device | str = "cpu") -> int | None:
    """Memory available on a device; None where the system does not report it."""
    if torch.device(device).type == "cuda":
        return torch.cuda.mem_get_info(device)[0]
    try:
        with open("/proc/meminfo") as lines:
            kilobytes = next(line.split()[1] for line in lines if line.startswith("MemAvailable"))
        return int(kilobytes) * 1024
    except (OSError, StopIteration):
        return _physical_bytes()


def _physical_bytes() -> int | None:
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError):  # Windows
        return None


def require_memory(pyramid: Pyramid, config: NetworkConfig) -> None:
    """Refuse a forward pass that would not fit.

    Raises
    ------
    ValueError
        The estimate exceeds what is free; the message names the points, both figures and what to do.
    """
    cure = f"use a network with a voxel larger than {config.backbone.voxel:g} m, or crop the clouds"
    require_bytes(forward_bytes(pyramid, config), pyramid.lengths[0], pyramid.points[0].device, cure)


def require_bytes(needed: int, lengths: tuple[int, ...], device: torch.device | str, cure: str) -> None:
    """Refuse what would not fit a device: bytes needed for target and source points of these numbers.

    Raises
    ------
    ValueError
        As `require_memory`.
    """
    free = available_bytes(device)
    if free is None or needed <= free:
        return
    raise ValueError(
        f"the network would take about {needed / 1e9:.2g} GB for {lengths[0]} target and {lengths[1]} source points, "
        f"and {free / 1e9:.2g} GB are free: {cure}"
    )
