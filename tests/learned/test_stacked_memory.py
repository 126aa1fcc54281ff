# SPDX-License-Identifier: MIT
"""Predator's and CoFiNet's memory and multiply-adds, told and measured."""

from __future__ import annotations

import sys
from typing import Any

import pytest
import torch
from four_pairs import four_pairs
from measured import peak_and_estimate

from benchmarks.measuring.multiply_adds import count_multiply_adds
from hybridreg.learned import memory_estimate
from hybridreg.learned.cofinet.network import CofinetNetwork
from hybridreg.learned.predator.network import PredatorNetwork

_MADE = """
from hybridreg.learned.cross3dreg.batch import make_batch
from hybridreg.learned.network_table import network_class
network = network_class("{name}").named("nano")
clouds = [rng.uniform(0, 70, (12000, 3)) * [1, 1, 0.02] for _ in range(2)]
batch = make_batch(*clouds, network.config, subsample=False)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is reset through /proc")
@pytest.mark.parametrize("name", ["predator", "cofinet"])
def test_the_estimate_is_near_and_not_below(name: str) -> None:
    real, estimate = peak_and_estimate(_MADE.format(name=name))
    assert real <= estimate  # what the allocator keeps differs from run to run by a tenth
    assert estimate - memory_estimate.SLACK <= 1.5 * real


def _counted(cls: Any) -> dict[str, float]:
    network = cls(cls.named_config("nano")).eval()
    return count_multiply_adds(network, four_pairs(network.config, points=400, extent=8.0)[0].batch)


def test_multiply_adds_of_predator() -> None:
    network = PredatorNetwork(PredatorNetwork.named_config("nano"))
    pyramid = four_pairs(network.config, points=400, extent=8.0)[0].batch.pyramid
    found = _counted(PredatorNetwork)
    target, source = pyramid.lengths[-1]
    dim = network.config.graph.dim
    assert found["attention"] == 2 * 2 * target * source * dim
    # By hand: decoder, heads, graph blocks; the residual blocks' unary layers come on top.
    counts = [sum(lengths) for lengths in pyramid.lengths]
    heads = counts[2] * (64 * dim + dim * dim + dim)
    graph = counts[2] * 2 * (2 * dim * dim + 2 * dim * 2 * dim + 4 * dim * dim)
    cross = counts[2] * (4 * dim * dim + 2 * dim * 2 * dim + 2 * dim * dim)
    decoder = 17 * (counts[2] * 34 + counts[1] * 32) + 18 * (counts[1] * 17 + counts[0] * 16)
    unary = counts[0] * (8 * 4 + 8 * 16 + 4 * 16)
    unary += counts[0] * 16 * 4 + counts[1] * 4 * 16  # strided
    unary += counts[1] * (16 * 8 + 8 * 32 + 16 * 32) + counts[1] * 32 * 8 + counts[2] * 8 * 32
    unary += counts[2] * (32 * 16 + 16 * 64 + 32 * 64)
    assert found["linear layers"] == heads + graph + cross + decoder + unary


def test_multiply_adds_of_cofinet() -> None:
    network = CofinetNetwork(CofinetNetwork.named_config("nano"))
    pyramid = four_pairs(network.config, points=400, extent=8.0)[0].batch.pyramid
    found = _counted(CofinetNetwork)
    target, source = pyramid.lengths[-1]
    assert found["superpoint scores"] == (target + 1) * (source + 1) * 64
    coarse = 2 * 64 * (2 * target**2 + 2 * source**2 + 2 * target * source)
    assert found["attention"] > coarse
    assert (found["attention"] - coarse) % (2 * 16 * 32 * 32 * 6) == 0, "whole pairs of patches of 32 points"
    assert torch.is_grad_enabled()
