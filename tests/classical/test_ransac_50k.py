# SPDX-License-Identifier: MIT
"""RANSAC-50K as published: four matches a sample, nothing refused, nothing refitted."""

from __future__ import annotations

import numpy as np
import pytest

from hybridreg import testing
from hybridreg.classical.ransac_50k import Ransac50k
from hybridreg.geometry import se3
from hybridreg.geometry.kabsch import kabsch
from hybridreg.matches import Correspondences, Pose
from hybridreg.scene import Scene


@pytest.fixture(scope="module")
def planted() -> tuple[Scene, Correspondences, np.ndarray]:
    scene, _ = testing.sample_scene()
    rng = np.random.default_rng(3)
    T = se3.from_rt(se3.yaw(70.0)[:3, :3], np.array([3.0, -5.0, 0.4]))
    source = rng.uniform(-20.0, 20.0, (300, 3))
    target = se3.apply(T, source) + 0.02 * rng.normal(size=(300, 3))
    target[150:] = rng.uniform(-20.0, 20.0, (150, 3))
    return scene, Correspondences.of(source, target), T


def run(planted: tuple[Scene, Correspondences, np.ndarray], seed: int = 0, **fields: float) -> Pose:
    scene, matches, _ = planted
    return Ransac50k(**fields)(scene, matches, np.random.default_rng(seed))  # type: ignore[arg-type]


def test_conforms() -> None:
    testing.check_stage(Ransac50k(iterations=2000))


def test_half_the_matches_wrong_is_no_matter(planted: tuple[Scene, Correspondences, np.ndarray]) -> None:
    pose, T = run(planted, iterations=2000), planted[2]
    error = se3.inverse(T) @ pose.T
    assert se3.angle_deg(error[:3, :3]) < 0.5
    assert np.linalg.norm(error[:3, 3]) < 0.3
    assert pose.inliers is not None
    assert pose.inliers[:150].mean() > 0.9
    assert pose.inliers[150:].sum() == 0


def test_the_pose_is_that_of_one_sample_and_not_refitted(
    planted: tuple[Scene, Correspondences, np.ndarray],
) -> None:
    _, matches, _ = planted
    pose = run(planted, iterations=500)
    assert pose.inliers is not None
    refitted, _ = kabsch(matches.source[pose.inliers], matches.target[pose.inliers])
    assert not np.allclose(refitted, pose.T, atol=1e-9)
    # Of all poses that were tried none has more inliers: the same draws, counted plainly.
    rng = np.random.default_rng(0)
    rows = rng.integers(0, 300, (500, 4))
    counts = []
    for sample in rows:
        T, _ = kabsch(matches.source[sample], matches.target[sample])
        counts.append(np.sum(np.linalg.norm(se3.apply(T, matches.source) - matches.target, axis=1) < 0.3))
    assert pose.inliers.sum() == max(counts)


def test_it_repeats_and_the_seed_matters(planted: tuple[Scene, Correspondences, np.ndarray]) -> None:
    first, again, other = (run(planted, seed, iterations=200) for seed in (0, 0, 1))
    assert np.array_equal(first.T, again.T)
    assert not np.array_equal(first.T, other.T)


@pytest.mark.parametrize("n", [0, 3])
def test_too_few_matches_are_no_pose(planted: tuple[Scene, Correspondences, np.ndarray], n: int) -> None:
    points = np.eye(3)[:n]
    pose = Ransac50k()(planted[0], Correspondences.of(points, points), np.random.default_rng(0))
    assert not pose.found


@pytest.mark.parametrize("fields", [{"max_distance": 0.0}, {"iterations": 0}])
def test_fields_are_checked(fields: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(fields))):
        Ransac50k(**fields)  # type: ignore[arg-type]
