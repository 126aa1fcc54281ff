# SPDX-License-Identifier: MIT
"""Farthest points, neighbours and point-pair features."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from hybridreg.geometry import se3
from hybridreg.learned.roitr.batch import make_batch, oriented_normals
from hybridreg.learned.roitr.config import named_config
from hybridreg.learned.roitr.pair_features import pair_features
from hybridreg.learned.roitr.point_levels import build_levels, farthest_points, nearest_others

NANO = named_config("nano")


def test_each_pick_is_the_farthest_from_those_before() -> None:
    points = np.random.default_rng(0).uniform(-5, 5, (300, 3)).astype(np.float32)
    rows = farthest_points(points, 40)
    assert rows[0] == 0
    for k in range(1, 40):
        gap = np.linalg.norm(points[:, None] - points[rows[:k]][None], axis=2).min(axis=1)
        assert gap[rows[k]] == pytest.approx(gap.max())


@given(st.integers(2, 30), st.integers(1, 12), st.integers(0, 3), st.integers(0, 10**6))
def test_neighbours_leave_the_point_itself_out(n: int, k: int, twins: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (n, 3))
    points[: min(n, twins + 1)] = points[0]  # the same place several times
    rows = np.arange(n)
    found = nearest_others(cKDTree(points), rows, k)
    assert found.shape == (n, min(k, n - 1))
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    own = np.take_along_axis(distance, found, axis=1)
    np.fill_diagonal(distance, np.inf)
    assert np.allclose(own, np.sort(distance, axis=1)[:, : found.shape[1]])
    # A point with more twins than were asked for may stand among them; no other may.
    if twins + 1 <= k:
        assert not (found == rows[:, None]).any()


def test_a_point_that_is_alone_is_its_own_neighbour() -> None:
    assert nearest_others(cKDTree(np.zeros((1, 3))), np.array([0]), 8).tolist() == [[0]]


@pytest.mark.parametrize("n", [4, 5, 17, 63])
def test_few_points_make_levels(n: int) -> None:
    rng = np.random.default_rng(n)
    points = rng.uniform(-1, 1, (n, 3)).astype(np.float32)
    normals = np.tile(np.float32([0, 0, 1]), (n, 1))
    levels = build_levels(points, normals, NANO)
    assert [len(p) for p in levels.points] == [n, max(1, n // 4), max(1, n // 4 // 4)]


def test_features_do_not_change_with_the_pose_and_are_in_range() -> None:
    rng = np.random.default_rng(1)
    points, near = rng.normal(size=(50, 3)), rng.normal(size=(50, 6, 3))
    normals, others = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in rng.normal(size=(2, 50, 6, 3)))
    given_ = [torch.from_numpy(a) for a in (points, normals[:, 0], near, others)]
    R = torch.from_numpy(se3.random_rotation(rng))
    turned = [given_[0] @ R.T + 3.0, given_[1] @ R.T, given_[2] @ R.T + 3.0, given_[3] @ R.T]
    one, two = pair_features(*given_), pair_features(*turned)  # type: ignore[arg-type]
    assert torch.allclose(one, two, atol=1e-12)
    assert ((one[..., 1:] >= 0) & (one[..., 1:] <= 1)).all()
    away = pair_features(
        torch.zeros(1, 3), torch.tensor([[0.0, 0, 1]]), torch.tensor([[[0.0, 0, 2]]]), -torch.eye(3)[None, 2:]
    )
    assert away.flatten().tolist() == pytest.approx([2.0, 0.0, 1.0, 1.0])


def test_normals_face_the_sensor_and_none_is_zero() -> None:
    rng = np.random.default_rng(2)
    wall = np.column_stack([rng.uniform(-3, 3, (200, 2)), np.full(200, 5.0)])
    for place, z in ((np.zeros(3), -1.0), (np.array([0.0, 0.0, 9.0]), 1.0), (None, 1.0)):
        assert np.allclose(oriented_normals(wall, place, 33)[:, 2], z, atol=1e-6)
    heap = np.zeros((40, 3)) + [1.0, 2.0, 2.0]  # one place, forty times: no direction is the least spread one
    assert np.allclose(np.linalg.norm(oriented_normals(heap, np.zeros(3), 33), axis=1), 1.0)


def test_bad_clouds_are_told() -> None:
    good = np.random.default_rng(0).normal(size=(20, 3))
    with pytest.raises(ValueError, match=r"source: RoITr needs .* at least 4 points, got shape \(3, 3\)"):
        make_batch(good, good[:3], NANO)
    bad = good.copy()
    bad[3] = np.nan
    with pytest.raises(ValueError, match="target: 1 of 20 points are not finite"):
        make_batch(bad, good, NANO)


def test_normals_of_published_weights_face_the_origin_wherever_the_sensor_was() -> None:
    cloud = np.random.default_rng(0).normal(size=(80, 3)) + [5.0, 0.0, 0.0]
    away = (np.array([50.0, 0.0, 0.0]),) * 2
    released, ours = named_config("roitr-3dmatch"), named_config("small")
    seen = [make_batch(cloud, cloud, c, viewpoints=away).target.normals[0] for c in (released, ours)]
    inward = (torch.from_numpy(cloud).float() * seen[0]).sum(1) <= 1e-6
    assert inward.all()
    assert ((torch.tensor([50.0, 0, 0]) - torch.from_numpy(cloud)) * seen[1]).sum(1).min() > -1e-6
