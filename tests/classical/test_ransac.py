# SPDX-License-Identifier: MIT
from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from made_matches import planted, random_pose
from needs_open3d import needs_open3d

from hybridreg.classical.ransac import Ransac
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Pose
from hybridreg.scene import Scene
from hybridreg.testing import check_stage

ROOT = Path(__file__).resolve().parents[2]


def run(scene: Scene, matches: Correspondences, seed: int = 0, **fields: object) -> Pose:
    return Ransac(**fields)(scene, matches, np.random.default_rng(seed))  # type: ignore[arg-type]


def close(A: np.ndarray, B: np.ndarray, deg: float = 0.5, metres: float = 0.2) -> bool:
    error = se3.inverse(A) @ B
    return bool(se3.angle_deg(error[:3, :3]) < deg and np.linalg.norm(error[:3, 3]) < metres)


def test_conforms() -> None:
    check_stage(Ransac())


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("inlier_ratio", [1.0, 0.3, 0.08])
def test_finds_planted_poses(scene: Scene, seed: int, inlier_ratio: float) -> None:
    matches, T, true = planted(seed, inlier_ratio=inlier_ratio)
    pose = run(scene, matches, seed)
    assert pose.found
    assert close(pose.T, T)
    assert pose.inliers is not None
    assert pose.inliers[true].mean() > 0.97
    assert pose.inliers[~true].sum() < 0.02 * len(true)


def test_three_in_a_sample_find_what_four_miss(scene: Scene) -> None:
    # 4 % right: 3.2 samples of three are expected to be all right in 50,000, and 0.13 of four.
    found = {3: 0, 4: 0}
    for seed in range(8):
        matches, T, _ = planted(seed, n=1000, inlier_ratio=0.04)
        for size in found:
            found[size] += close(run(scene, matches, seed, sample_size=size).T, T)
    assert found[3] >= 6
    assert found[4] <= 3


def test_local_optimisation_gains_inliers(scene: Scene) -> None:
    gained = []
    for seed in range(5):
        matches, _, _ = planted(seed, inlier_ratio=0.1, noise=0.1)
        counts = [
            int(run(scene, matches, seed, local_optimisation=on, max_distance=0.25).inliers.sum())
            for on in (False, True)
        ]
        gained.append(counts[1] - counts[0])
    assert min(gained) >= 0
    assert max(gained) > 0


def test_weights_guide_the_samples(scene: Scene) -> None:
    # One match in a hundred is right: hopeless for uniform samples, easy where weights point at them.
    hits = {"uniform": 0, "weighted": 0}
    for seed in range(5):
        matches, T, true = planted(seed, n=2000, inlier_ratio=0.01)
        weighted = Correspondences.of(matches.source, matches.target, np.where(true, 10.0, 1.0))
        hits["uniform"] += close(run(scene, matches, seed).T, T)
        hits["weighted"] += close(run(scene, weighted, seed).T, T)
    assert hits["weighted"] == 5
    assert hits["uniform"] <= 2


def test_a_second_pose_with_near_support_is_a_rival(scene: Scene) -> None:
    matches, T, _ = planted(0, n=1000, inlier_ratio=0.3)
    other = random_pose(np.random.default_rng(9))
    target = matches.target.copy()
    target[300:540] = se3.apply(other, matches.source[300:540])
    pose = run(scene, Correspondences.of(matches.source, target))
    assert close(pose.T, T)
    assert len(pose.rivals) == 1
    assert close(pose.rivals[0], other)
    assert len(run(scene, Correspondences.of(matches.source, target), rival_share=0.9).rivals) == 0


def test_the_confidence_stops_early_and_one_draws_all(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    from hybridreg.classical import hypotheses

    drawn: list[int] = []
    draw = hypotheses.draw
    monkeypatch.setattr(hypotheses, "draw", lambda n, *rest: (drawn.append(n), draw(n, *rest))[1])
    matches, _, _ = planted(0, inlier_ratio=0.5)
    run(scene, matches)
    assert sum(drawn) <= 5_000
    drawn.clear()
    run(scene, matches, confidence=1.0, iterations=12_345)
    assert sum(drawn) == 12_345


@pytest.mark.parametrize("n", [0, 1, 2, 3, 4, 5])
def test_few_matches(scene: Scene, n: int) -> None:
    rng = np.random.default_rng(0)
    T, source = random_pose(rng), rng.uniform(-10, 10, (n, 3))
    pose = run(scene, Correspondences.of(source, se3.apply(T, source)))
    assert pose.found == (n >= 3)
    assert pose.inliers is not None
    assert pose.inliers.shape == (n,)
    if pose.found:
        np.testing.assert_allclose(pose.T, T, atol=1e-6)


@pytest.mark.parametrize("shape", ["one place", "line", "repeated", "zero weights", "not finite"])
def test_hostile_matches(scene: Scene, shape: str) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-10, 10, (50, 3))
    T = random_pose(rng)
    weight = np.ones(50)
    if shape == "one place":
        points = np.ones((50, 3))
    elif shape == "line":
        points = np.outer(np.linspace(0, 30, 50), [1.0, 2.0, 3.0])
    elif shape == "repeated":
        points = np.repeat(points[:2], 25, axis=0)
    elif shape == "zero weights":
        weight = np.zeros(50)
    else:
        points[7] = np.nan
    pose = run(scene, Correspondences.of(points, se3.apply(T, points), weight))
    se3.check(pose.T)
    assert pose.found == (shape == "not finite")
    if pose.found:
        np.testing.assert_allclose(pose.T, T, atol=1e-6)


def test_too_many_matches_are_thinned_and_noted(scene: Scene) -> None:
    matches, T, _ = planted(0, n=6000)
    pose = run(scene, matches, max_matches=1000)
    assert close(pose.T, T)
    assert pose.inliers.shape == (6000,)
    assert any("1000 of 6000" in note for note in scene.notes)


SCRIPT = """
import hashlib, sys
import numpy as np
sys.path[:0] = [{root!r}, {here!r}]
from made_matches import planted
from hybridreg import testing
from hybridreg.classical.ransac import Ransac
scene = testing.sample_scene()[0]
digest = hashlib.sha256()
for seed in range(4):
    matches, _, _ = planted(seed, n=4000, inlier_ratio=0.05 + 0.1 * seed, noise=0.2)
    pose = Ransac(confidence=1.0, rival_share=0.02)(scene, matches, np.random.default_rng(seed))
    digest.update(pose.T.tobytes() + pose.inliers.tobytes() + pose.rivals.tobytes())
print(digest.hexdigest())
"""


def test_the_same_bits_for_any_number_of_threads() -> None:
    script = SCRIPT.format(root=str(ROOT), here=str(Path(__file__).parent))
    digests = set()
    for threads in ("1", "2"):
        variables = {"OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"}
        env = {**os.environ, **dict.fromkeys(variables, threads)}
        run = subprocess.run(
            [sys.executable, "-c", script], env=env, capture_output=True, text=True, check=True
        )
        digests.add(run.stdout.strip())
    assert len(digests) == 1
    assert len(digests.pop()) == 2 * hashlib.sha256().digest_size


@needs_open3d
def test_open3d_backend_finds_the_same_pose(scene: Scene) -> None:
    matches, T, _ = planted(0, inlier_ratio=0.3)
    assert close(run(scene, matches, backend="open3d").T, T, 1.0, 0.5)
    assert not run(scene, planted(0, n=3, inlier_ratio=0.0)[0], backend="open3d").found


@pytest.mark.parametrize(
    "fields, message",
    [
        ({"iterations": 0}, "iterations=0"),
        ({"sample_size": 2}, "sample_size=2"),
        ({"max_distance": 0.0}, "max_distance=0.0"),
        ({"edge_ratio": 1.5}, "edge_ratio=1.5"),
        ({"confidence": -0.1}, "confidence=-0.1"),
        ({"max_matches": 2}, "max_matches=2"),
        ({"backend": "pcl"}, "backend: expected one of 'own', 'open3d', got 'pcl'"),
    ],
)
def test_bad_settings(fields: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Ransac(**fields)  # type: ignore[arg-type]
