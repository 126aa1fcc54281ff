# SPDX-License-Identifier: MIT
"""Every network works in the calling thread alone, whatever its stage."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch
from torch.nn.modules.module import register_module_forward_pre_hook

import hybridreg as hr
from hybridreg.testing import sample_scene

OVERLAPS = [hr.Omp(untrained=True), hr.PredatorOverlap(untrained=True)]
MATCHERS = [
    hr.Vgam(untrained=True), hr.GeoTransformer(untrained=True), hr.DenseFeatures(untrained=True),
    hr.Predator(untrained=True), hr.Cofinet(untrained=True), hr.Fcgf(untrained=True), hr.Roitr(untrained=True),
    hr.Vrhcf(untrained=True),
]  # fmt: skip


@pytest.mark.parametrize(
    "stage", [*OVERLAPS, *MATCHERS, hr.OmNet(untrained=True)], ids=lambda stage: type(stage).__name__
)
def test_a_network_runs_in_one_thread_and_gives_the_others_back(stage: Any) -> None:
    counts: set[int] = set()
    before = torch.get_num_threads()
    hook = register_module_forward_pre_hook(lambda *_: counts.add(torch.get_num_threads()))
    torch.set_num_threads(2)
    try:
        scene = sample_scene()[0]
        full = hr.Overlap.full(len(scene.source), len(scene.target))
        if stage in OVERLAPS:
            stage(scene)
        elif stage in MATCHERS:
            stage(scene, full)
        else:
            stage(scene, hr.Correspondences.none(), np.random.default_rng(0))
        assert counts == {1}
        assert torch.get_num_threads() == 2
    finally:
        hook.remove()
        torch.set_num_threads(before)
