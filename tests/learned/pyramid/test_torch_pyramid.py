# SPDX-License-Identifier: MIT
"""Grids, neighbours and the pyramid."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from streets import street

from hybridreg.learned.cross3dreg.batch import make_batch
from hybridreg.learned.cross3dreg.config import BackboneConfig, NetworkConfig
from hybridreg.learned.pyramid import neighbors as module
from hybridreg.learned.pyramid.grid_subsample import grid_subsample
from hybridreg.learned.pyramid.input_features import input_features
from hybridreg.learned.pyramid.neighbors import _radius_neighbors_tensor, nearest_neighbor, radius_neighbors
from hybridreg.learned.pyramid.point_pyramid import build_pyramid, calibrate_neighbor_limits

PLAN = BackboneConfig(stages=4, voxel=0.5, init_dim=16, groups=4, neighbor_limits=(12, 12, 12, 12))


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 200), st.floats(0.2, 3.0), st.integers(0, 10**6))
def test_grid_gives_the_cells_centroids(n: int, voxel: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-20, 20, (n, 3)).astype(np.float32)
    size = np.float32(voxel)
    cells = np.floor((points - np.floor(points.min(0) / size) * size) / size).astype(int)
    want = np.array([points[(cells == c).all(1)].mean(0, dtype=np.float64) for c in np.unique(cells, axis=0)])
    got = grid_subsample(torch.from_numpy(points), voxel).numpy()
    permuted = grid_subsample(torch.from_numpy(points[rng.permutation(n)]), voxel).numpy()
    assert len(got) == len(want) == len(permuted)
    assert np.abs(got[np.lexsort(got.T)] - want[np.lexsort(want.astype(np.float32).T)]).max() < 1e-5
    assert np.array_equal(got, permuted) or np.abs(got - permuted).max() < 1e-5


@pytest.mark.parametrize(("points", "voxel"), [(torch.zeros(0, 3), 1.0), (torch.zeros(2, 3), 0.0)])
def test_grid_refuses_nonsense(points: torch.Tensor, voxel: float) -> None:
    with pytest.raises(ValueError, match="positive voxel"):
        grid_subsample(points, voxel)


def test_grid_refuses_cells_that_cannot_be_numbered() -> None:
    with pytest.raises(ValueError, match="too small"):
        grid_subsample(torch.tensor([[0.0, 0, 0], [1e6, 1e6, 1e6]]), 1e-2)


def test_tensor_search_equals_the_tree(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_CHUNK_PAIRS", 5000)
    supports, queries = torch.from_numpy(street(1, 600)), torch.from_numpy(street(2, 90))
    tree = radius_neighbors(queries, supports, 3.0, 9)
    tensor = _radius_neighbors_tensor(queries, supports, 3.0, 9)
    assert torch.equal(tree, tensor)
    assert (tree == 600).any()
    assert (tree[:, 0] < 600).any()


def test_fewer_supports_than_the_limit() -> None:
    supports = torch.tensor([[0.0, 0, 0], [1.0, 0, 0]])
    want = [[0, 1, 2, 2]]
    query = torch.tensor([[0.1, 0, 0]])
    assert radius_neighbors(query, supports, 2.0, 4).tolist() == want
    assert _radius_neighbors_tensor(query, supports, 2.0, 4).tolist() == want
    assert radius_neighbors(query, supports, 2.0, 1).tolist() == [[0]]
    assert nearest_neighbor(torch.tensor([[50.0, 0, 0]]), supports).tolist() == [1]


def test_neighbours_never_cross_clouds(pair: tuple[np.ndarray, np.ndarray]) -> None:
    pyramid = build_pyramid(torch.from_numpy(pair[0]), torch.from_numpy(pair[1]), PLAN, subsample=True)
    for stage in range(PLAN.stages):
        n_target, n_source = pyramid.lengths[stage]
        total = n_target + n_source
        index = pyramid.neighbors[stage]
        assert index.shape == (total, 12)
        assert (index[:n_target][index[:n_target] < total] < n_target).all()
        assert (index[n_target:] >= n_target).all()
        gap = (pyramid.points[stage][index.clamp_max(total - 1)] - pyramid.points[stage][:, None]).norm(
            dim=-1
        )
        assert (gap[index < total] <= PLAN.radius(stage)).all()
    assert (pyramid.upsampling[0] < len(pyramid.points[1])).all()


def test_an_empty_cloud_is_named() -> None:
    with pytest.raises(ValueError, match="source cloud has 0 points"):
        build_pyramid(torch.zeros(3, 3), torch.zeros(0, 3), PLAN)


def test_one_point_clouds_have_a_pyramid() -> None:
    pyramid = build_pyramid(torch.zeros(1, 3), torch.ones(1, 3), PLAN)
    assert pyramid.lengths == ((1, 1),) * 4


def test_calibrated_limits_hold_the_share(pair: tuple[np.ndarray, np.ndarray]) -> None:
    clouds = (torch.from_numpy(pair[0]), torch.from_numpy(pair[1]))
    limits = calibrate_neighbor_limits([clouds], PLAN, share=0.8)
    assert len(limits) == 4
    assert calibrate_neighbor_limits([clouds], PLAN, share=1.0)[0] > limits[0] > 1


def test_geometric_features_tell_ground_from_wall(pair: tuple[np.ndarray, np.ndarray]) -> None:
    batch = make_batch(*pair, NetworkConfig(backbone=PLAN))
    features = input_features(batch.pyramid, "geometric")
    height = batch.pyramid.clouds(0)[0][:, 2]
    upright = features[: len(height), 2]
    assert features.shape == (len(batch.features), 4)
    assert torch.isfinite(features).all()
    assert upright[height < 0.1].median() > 0.95
    assert upright[height > 4.0].median() < 0.3
