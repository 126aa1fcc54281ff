# SPDX-License-Identifier: MIT
from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hybridreg import Pair, VoxelGrid
from hybridreg.classical import voxel as module
from hybridreg.classical.voxel import voxel_centroids
from hybridreg.resolution import default_voxel

clouds = st.builds(
    lambda seed, n, spread: np.random.default_rng(seed).normal(size=(n, 3)) * spread,
    st.integers(0, 10_000),
    st.integers(1, 300),
    st.floats(0.1, 50.0),
)
voxels = st.floats(0.05, 20.0)


def slow_centroids(points: np.ndarray, voxel: float) -> np.ndarray:
    """The definition, one point at a time."""
    origin = points.min(axis=0) - 1e-5 * voxel
    cells = defaultdict(list)
    for p in points:
        cells[tuple(np.floor((p - origin) / voxel).astype(int)[::-1])].append(p)
    return np.array([np.mean(cells[key], axis=0) for key in sorted(cells)])


@given(clouds, voxels)
def test_equals_the_definition(points: np.ndarray, voxel: float) -> None:
    assert np.allclose(voxel_centroids(points, voxel), slow_centroids(points, voxel), atol=1e-9)


@given(clouds, voxels, st.integers(0, 100))
def test_order_of_points_does_not_matter(points: np.ndarray, voxel: float, seed: int) -> None:
    shuffled = np.random.default_rng(seed).permutation(points)
    assert np.allclose(voxel_centroids(points, voxel), voxel_centroids(shuffled, voxel), atol=1e-9)


@given(clouds, voxels)
def test_keeps_the_centre_of_mass(points: np.ndarray, voxel: float) -> None:
    centroids = voxel_centroids(points, voxel)
    assert (centroids >= points.min(axis=0) - 1e-9).all()
    assert (centroids <= points.max(axis=0) + 1e-9).all()
    assert 1 <= len(centroids) <= len(points)


@given(st.lists(st.integers(0, 50), min_size=1, max_size=200))
def test_cells_too_many_for_the_quick_way_are_ranked_alike(cells: list[int]) -> None:
    key = np.array(cells, dtype=np.int64)
    quick, slow = module._members(key, 51), module._members(key, 2**62)
    assert np.array_equal(quick[0], slow[0])
    assert quick[1] == slow[1] == len(set(cells))


def test_millimetre_data_does_not_depend_on_the_last_digit() -> None:
    points = np.round(np.random.default_rng(0).uniform(-50, 50, (5000, 3)), 3)
    far = (points + 5e6) - 5e6  # the same to 1e-9
    assert len(voxel_centroids(points, 0.25)) == len(voxel_centroids(far, 0.25))


def test_an_absurd_voxel_is_refused() -> None:
    points = np.random.default_rng(0).uniform(-1e6, 1e6, (50, 3))
    with pytest.raises(ValueError, match="larger voxel or check the unit"):
        voxel_centroids(points, 1e-9)


@pytest.mark.parametrize("voxel", [0.0, -1.0, float("nan"), float("inf")])
def test_a_voxel_is_a_positive_length(voxel: float) -> None:
    with pytest.raises(ValueError, match="positive"):
        VoxelGrid(voxel=voxel)


def test_density_match_evens_the_counts_out() -> None:
    rng = np.random.default_rng(0)
    pair = Pair.of(rng.uniform(-20, 20, (2000, 3)), rng.uniform(-20, 20, (60_000, 3)))
    kept, matched = VoxelGrid(voxel=1.0)(pair), VoxelGrid(voxel=1.0, density="match")(pair)
    assert len(kept.target) > 10 * len(kept.source)
    assert len(matched.target) == pytest.approx(len(matched.source), rel=0.05)
    assert matched.target.spacing > 1.0


def test_derived_voxel_follows_the_scale_and_is_noted() -> None:
    points = np.random.default_rng(0).normal(size=(4000, 3)) * 20
    pair = Pair.of(points, points * 1.5)
    scene = VoxelGrid()(pair)
    reach = np.quantile(np.linalg.norm(points - np.median(points, axis=0), axis=1), 0.9)
    assert scene.spacing == default_voxel(pair.source, pair.target) == pytest.approx(reach / 60, rel=0.05)
    assert scene.notes == [f"voxel {scene.spacing:.3g} m, derived from the clouds' reach"]
    far = Pair.of(points * 1000, points * 1500)
    assert default_voxel(far.source, far.target) == pytest.approx(1000 * scene.spacing)


def test_derived_voxel_leaves_no_cloud_too_many_points() -> None:
    # One sensor sees a corner of what the other sees: a sixtieth of its reach would cut that into very many cells.
    rng = np.random.default_rng(0)
    near, wide = rng.uniform(-3, 3, (2000, 3)), rng.uniform(-30, 30, (80_000, 3))
    pair = Pair.of(near, wide)
    scene = VoxelGrid()(pair)
    reached = default_voxel(pair.source, pair.target)
    assert len(scene.target) <= 30_000
    assert len(scene.target) > 20_000
    assert scene.source.spacing == scene.target.spacing > reached
    assert scene.notes == [
        f"voxel {scene.spacing:.3g} m, derived from the clouds' reach ({reached:.3g} m) and the number of points"
    ]
    assert len(VoxelGrid(voxel=reached)(pair).target) > 70_000


def test_derived_voxel_of_a_cloud_that_is_nearly_one_place() -> None:
    points = np.zeros((100, 3))
    points[:3] = np.eye(3)
    pair = Pair.of(points, points + np.eye(3)[0])
    assert default_voxel(pair.source, pair.target) > 0
