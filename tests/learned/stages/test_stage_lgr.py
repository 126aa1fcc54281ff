# SPDX-License-Identifier: MIT
"""Local-to-global registration as a stage."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import hybridreg as hr
from hybridreg import testing
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Described
from hybridreg.scene import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return testing.sample_scene()[0]


def pose(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return se3.from_rt(Rotation.random(random_state=seed).as_matrix(), rng.uniform(-20, 20, 3))


def planted(
    seed: int, *poses: np.ndarray, groups: int = 10, right: int = 3, size: int = 10
) -> Correspondences:
    """Groups of matches: `right` of them follow each pose, the others follow none."""
    rng = np.random.default_rng(seed)
    source = rng.uniform(-15, 15, (groups * size, 3))
    target = rng.uniform(-30, 30, source.shape)
    for i, T in enumerate(poses):
        rows = slice(i * right * size, (i + 1) * right * size)
        target[rows] = se3.apply(T, source[rows])
    return Correspondences(
        source=source,
        target=target,
        weight=rng.uniform(0.1, 1.0, len(source)),
        group=np.repeat(np.arange(groups), size),
    )


def run(scene: Scene, matches: Correspondences, **fields: object) -> hr.Pose:
    return hr.Lgr(**fields)(scene, matches, np.random.default_rng(0))  # type: ignore[arg-type]


@settings(max_examples=25)
@given(st.integers(0, 10**6), st.floats(1e-9, 1e9))
def test_three_good_groups_of_ten_give_the_exact_pose(seed: int, scale: float) -> None:
    made, _ = testing.sample_scene()
    matches = planted(seed, pose(seed))
    matches = dataclasses.replace(matches, weight=matches.weight * scale)
    found = run(made, matches, max_distance=0.5)
    assert np.allclose(found.T, pose(seed), atol=1e-7)
    assert found.inliers is not None
    assert found.inliers[:30].all()
    assert found.inliers.sum() < 35
    assert len(found.rivals) == 0
    assert found.T.dtype == np.float64


def test_a_second_pose_with_nearly_the_support_is_a_rival(scene: Scene) -> None:
    matches = planted(3, pose(1), pose(2), right=3)
    matches = dataclasses.replace(matches, weight=np.ones(len(matches)))
    cut = np.r_[0:30, 30:54, 60:100]  # the second pose has four fifths of the support
    matches = _take(matches, cut)
    found = run(scene, matches)
    assert np.allclose(found.T, pose(1), atol=1e-7)
    assert len(found.rivals) == 1
    assert np.allclose(found.rivals[0], pose(2), atol=1e-7)
    assert len(run(scene, matches, rival_share=0.9).rivals) == 0


def test_groups_too_small_fall_back_to_a_fit_to_all() -> None:
    made, _ = testing.sample_scene()
    T = pose(4)
    matches = planted(4, T, groups=30, right=30, size=2)
    found = run(made, matches)
    assert np.allclose(found.T, T, atol=1e-7)
    assert any("no group has 3 matches" in note for note in made.notes)


def test_the_radius_follows_the_matches_then_the_scene(scene: Scene) -> None:
    T = pose(5)
    matches = planted(5, T, right=10)
    off = matches.target + np.where(np.arange(100)[:, None] % 2 == 0, 1.0, -1.0) * [0.0, 0.0, 0.5 * 1.1]
    matches = dataclasses.replace(matches, target=off)
    counts = [
        int(run(scene, dataclasses.replace(matches, spacing=s), **f).inliers.sum())  # type: ignore[union-attr]
        for s, f in ((0.3, {}), (None, {}), (0.3, {"max_distance": 2.0}))
    ]
    assert scene.spacing == 0.4
    assert counts[0] == 50, "half of the matches lie 0.55 m from the other half"
    assert counts[1] == 100
    assert counts[2] == 100


def test_guided_matching_needs_features(scene: Scene) -> None:
    with pytest.raises(ValueError, match="geotransformer or vgam, or guided = false"):
        run(scene, planted(5, pose(5)), guided=True)


def test_guided_matching_starts_where_the_vote_ended(scene: Scene) -> None:
    T, rng = pose(8), np.random.default_rng(8)
    points, features = rng.uniform(-15, 15, (400, 3)), rng.normal(size=(400, 16))
    features = (features / np.linalg.norm(features, axis=1, keepdims=True)).astype(np.float32)
    off = planted(8, se3.from_rt(np.eye(3), np.array([0.6, 0.0, 0.0])) @ T)
    matches = dataclasses.replace(
        off, spacing=0.8, described=(Described(points, features), Described(se3.apply(T, points), features))
    )
    assert not np.allclose(run(scene, matches).T, T, atol=0.1)
    assert np.allclose(run(scene, matches, guided=True).T, T, atol=1e-6)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_too_few_matches_are_no_pose(scene: Scene, n: int) -> None:
    matches = _take(planted(6, pose(6)), np.arange(n))
    assert not run(scene, matches).found


def test_matches_without_weight_or_place_are_left_out(scene: Scene) -> None:
    T = pose(7)
    matches = planted(7, T)
    weight, source = matches.weight.copy(), matches.source.copy()
    weight[:3], weight[3:6], source[6:8] = 0.0, np.nan, np.inf
    spoiled = dataclasses.replace(matches, weight=weight, source=source)
    found = run(scene, spoiled, max_distance=0.5)
    assert np.allclose(found.T, T, atol=1e-7)
    assert found.inliers is not None
    assert len(found.inliers) == len(matches)
    assert not found.inliers[:8].any()
    assert found.inliers[8:30].all()


def test_matches_on_a_line_are_told(scene: Scene) -> None:
    along = np.linspace(-10, 10, 30)[:, None] * np.array([1.0, 2.0, 0.5])
    made, _ = testing.sample_scene()
    matches = Correspondences(
        source=along, target=along + 1.0, weight=np.ones(30), group=np.repeat(np.arange(3), 10)
    )
    found = run(made, matches)
    assert found.found
    assert any("on one line" in note for note in made.notes)


@pytest.mark.parametrize(
    "fields",
    [{"max_distance": 0.0}, {"min_group": 2}, {"steps": 0}, {"max_votes": 0}, {"rival_share": 1.1}],
)
def test_fields_are_checked(fields: dict[str, float]) -> None:
    (name,) = fields
    with pytest.raises(ValueError, match=name):
        hr.Lgr(**fields)  # type: ignore[arg-type]


def _take(matches: Correspondences, rows: np.ndarray) -> Correspondences:
    columns = ("source", "target", "weight", "group")
    return dataclasses.replace(matches, **{name: getattr(matches, name)[rows] for name in columns})
