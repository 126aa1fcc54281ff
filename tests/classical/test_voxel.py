# SPDX-License-Identifier: MIT
from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridreg import Pair, Pipeline, PointCloud, VoxelGrid, thinning
from hybridreg.geometry import voxel_cells as cells_of
from hybridreg.geometry.voxel_cells import voxel_centroids
from hybridreg.resolution import default_voxel
from hybridreg.testing import sample_pair

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
    quick, slow = cells_of._members(key, 51), cells_of._members(key, 2**62)
    for one, other in zip(quick, slow, strict=True):
        assert np.array_equal(one, other)
    assert len(quick[1]) == len(set(cells))


@given(clouds, voxels)
@settings(deadline=None)
def test_lots_give_the_same_cells(points: np.ndarray, voxel: float) -> None:
    whole = cells_of.voxel_cells(points, voxel)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cells_of, "_LOT", 7)
        patch.setattr(cells_of, "_KEPT", 20)
        lots = cells_of.voxel_cells(points, voxel)
    np.testing.assert_allclose(lots.centroids, whole.centroids, rtol=1e-12, atol=1e-9)
    assert np.array_equal(lots.first, whole.first)


def test_a_large_cloud_is_thinned_with_its_places(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-20, 20, (5000, 3)) * [1, 1, 0.1]
    rows = (points[:, 0] > 0).astype(int)
    many = np.concatenate([points, points + rng.normal(0, 1e-3, points.shape)])
    source = PointCloud.of(
        many, viewpoint=(np.array([[-10.0, 0, 0], [10, 0, 0]]), np.tile(rows, 2)), nonfinite="drop"
    )
    pair = Pair(source=source, target=PointCloud.of(points))
    assert thinning.thinned(pair, 1.0) is pair
    monkeypatch.setattr(thinning, "_MANY", 6000)
    thin = thinning.thinned(pair, 0.4)
    assert thin.target is pair.target
    assert len(thin.source) <= 5300
    places, of_point, _ = thin.source.seen
    assert of_point is not None
    clear = np.abs(thin.source.points[:, 0]) > 0.2
    assert np.array_equal(places[of_point[clear], 0] > 0, thin.source.points[clear, 0] > 0)
    scene = VoxelGrid(voxel=0.4)(pair)
    assert any("10000 points were first thinned" in note for note in scene.notes)
    kept = VoxelGrid(voxel=0.4)
    monkeypatch.setattr(thinning, "_MANY", 10**9)
    whole = kept(pair)
    assert abs(len(scene.source) - len(whole.source)) <= 0.02 * len(whole.source)


def test_matches_by_row_name_points_of_the_whole_cloud(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(thinning, "_MANY", 100)
    pair, _ = sample_pair()
    rows = np.column_stack([np.arange(len(pair.source))[-40:]] * 2) % len(pair.target)
    trace = Pipeline(match="none", estimate="identity", refine="none").trace(pair, matches=rows)
    assert np.array_equal(trace.matches.source, pair.source.points[rows[:, 0]])


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
    assert scene.notes == [f"voxel {scene.spacing:.3g} m, derived from the clouds' extent"]
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
        f"voxel {scene.spacing:.3g} m, derived from the clouds' extent ({reached:.3g} m) and the number of points"
    ]
    assert len(VoxelGrid(voxel=reached)(pair).target) > 70_000


def test_derived_voxel_of_a_cloud_that_is_nearly_one_place() -> None:
    points = np.zeros((100, 3))
    points[:3] = np.eye(3)
    pair = Pair.of(points, points + np.eye(3)[0])
    assert default_voxel(pair.source, pair.target) > 0


@pytest.mark.parametrize("lone", [1, 3])
def test_points_far_from_all_others_are_named_where_they_make_too_many_cells(lone: int) -> None:
    # As laspy 2.7.0 stores NaN in millimetres; a larger voxel was advised, at which the others become one cell.
    points = np.random.default_rng(0).uniform(-20.0, 20.0, (1000, 3))
    points[:lone] = -(2**31) * 0.001
    with pytest.raises(ValueError, match=rf"{lone} of 1000 points lie up to 3.72e\+06 m .*remove them"):
        voxel_centroids(points, 0.3)
    assert len(voxel_centroids(points[lone:], 0.3)) > 900
