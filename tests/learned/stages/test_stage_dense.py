# SPDX-License-Identifier: MIT
"""Matches by learned point features alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import hybridreg as hr
from hybridreg import testing
from hybridreg.geometry import se3
from hybridreg.learned.cross3dreg.config import NetworkConfig
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.matches import Overlap
from hybridreg.pair import Pair


def cylindrical() -> NetworkConfig:
    config = named_config("nano")
    backbone = replace(config.backbone, kernel="cylindrical", input_features="geometric", fine_stage=1)
    return replace(config, backbone=backbone)


@pytest.fixture(scope="module")
def turned() -> tuple[Pair, np.ndarray]:
    """A cloud on a grid of its own, and the same points turned by a quarter, which moves every grid cell whole."""
    points = testing.sample_pair(n_points=2500)[0].source.points
    R = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return Pair.of(points, points @ R.T, id="turned"), se3.from_rt(R, np.zeros(3))


def errors(stage: hr.DenseFeatures, pair: Pair, T: np.ndarray, overlap: Overlap | None = None) -> np.ndarray:
    scene = hr.VoxelGrid(voxel=0.5)(pair)
    everywhere = Overlap(np.ones(len(scene.source.points)), np.ones(len(scene.target.points)))
    matches = stage(scene, overlap or everywhere)
    assert matches.spacing == pytest.approx(0.5)
    return np.linalg.norm(matches.source @ T[:3, :3].T + T[:3, 3] - matches.target, axis=1)


def test_cylindrical_features_match_a_turned_cloud_untrained(
    turned: tuple[Pair, np.ndarray], make_weights: Callable[..., str]
) -> None:
    pair, T = turned
    stage = hr.DenseFeatures(weights=make_weights(cylindrical()))
    found = errors(stage, pair, T)
    assert len(found) > 100
    assert np.mean(found < 0.5) > 0.9
    spatial = replace(cylindrical(), backbone=replace(cylindrical().backbone, kernel="spatial"))
    other = errors(hr.DenseFeatures(weights=make_weights(spatial, name="spatial")), pair, T)
    assert np.mean(other < 0.5) < 0.5


def test_a_mask_leaves_points_out_unless_too_few_remain(
    turned: tuple[Pair, np.ndarray], make_weights: Callable[..., str]
) -> None:
    pair, _ = turned
    stage = hr.DenseFeatures(weights=make_weights(cylindrical()))
    scene = hr.VoxelGrid(voxel=0.5)(pair)
    right = (scene.source.points[:, 0] > 0).astype(float)
    everywhere = np.ones(len(scene.target.points))
    assert (stage(scene, Overlap(right, everywhere)).source[:, 0] > -0.5).all()
    nowhere = stage(scene, Overlap(np.zeros_like(right), everywhere))
    assert len(nowhere) == len(stage(scene, Overlap(np.ones_like(right), everywhere)))


def test_refuses_a_threshold_that_is_no_share() -> None:
    with pytest.raises(ValueError, match=r"min_overlap=1\.5"):
        hr.DenseFeatures(untrained=True, min_overlap=1.5)
