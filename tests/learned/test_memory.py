# SPDX-License-Identifier: MIT
"""The memory estimate beside what a forward pass really takes, and the refusal."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import torch
from measured import peak_and_estimate
from streets import street

from hybridreg.learned import memory_estimate
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.pyramid.point_pyramid import build_pyramid

_MADE = """
from hybridreg.learned.cross3dreg.batch import make_batch
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
network = RegistrationNetwork.named("nano")
clouds = [rng.uniform(0, 70, (20000, 3)) * [1, 1, 0.02] for _ in range(2)]
batch = make_batch(*clouds, network.config, subsample=False)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is reset through /proc")
def test_the_estimate_is_near_and_not_below() -> None:
    # Blocks that go back to the system at once leave the heap's slack out, which differs from run to run by some tens
    # of megabytes.
    real, estimate = peak_and_estimate(_MADE)
    assert real <= estimate - memory_estimate.SLACK <= 1.25 * real


def test_too_large_a_pair_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    config = named_config("nano")
    clouds = [torch.from_numpy(street(seed, 300)) for seed in (1, 2)]
    pyramid = build_pyramid(*clouds, config.backbone)
    memory_estimate.require_memory(pyramid, config)
    monkeypatch.setattr(memory_estimate, "available_bytes", lambda device: 10**6)
    with pytest.raises(ValueError, match=r"300 target and 300 source points.*voxel larger than 0.5 m"):
        memory_estimate.require_memory(pyramid, config)


def test_the_machine_tells_what_is_free() -> None:
    free = memory_estimate.available_bytes()
    assert free is None or free > 2**20


def test_more_points_take_more() -> None:
    config = named_config("nano")
    rng = np.random.default_rng(0)
    sizes = []
    for n in (100, 1000):
        cloud = torch.from_numpy((rng.uniform(0, n**0.5, (n, 3)) * [1, 1, 0.02]).astype(np.float32))
        sizes.append(memory_estimate.forward_bytes(build_pyramid(cloud, cloud, config.backbone), config))
    assert sizes[0] < sizes[1]
