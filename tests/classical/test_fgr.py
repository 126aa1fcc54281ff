# SPDX-License-Identifier: MIT
from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from made_matches import planted
from needs_open3d import needs_open3d

from hybridreg.classical.fgr import Fgr
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences
from hybridreg.scene import Scene
from hybridreg.testing import check_stage

pytestmark = needs_open3d
ROOT = Path(__file__).resolve().parents[2]


def test_conforms() -> None:
    check_stage(Fgr())


@pytest.mark.parametrize("seed", range(4))
def test_finds_planted_poses(scene: Scene, rng: np.random.Generator, seed: int) -> None:
    matches, T, true = planted(seed, inlier_ratio=0.4)
    pose = Fgr()(scene, matches, rng)
    error = se3.inverse(T) @ pose.T
    assert se3.angle_deg(error[:3, :3]) < 0.5
    assert np.linalg.norm(error[:3, 3]) < 0.2
    assert pose.inliers is not None
    assert pose.inliers[true].mean() > 0.95


def test_lengths_are_metres(scene: Scene, rng: np.random.Generator) -> None:
    # Read as a share of the diameter, 0.1 would be metres wide, and outliers 0.8 m off would pull the pose.
    matches, T, _ = planted(0, n=600, inlier_ratio=1.0, noise=0.01)
    target = matches.target.copy()
    target[:250] += [0.0, 0.0, 0.8]
    pose = Fgr(max_distance=0.1)(scene, Correspondences.of(matches.source, target), rng)
    np.testing.assert_allclose(pose.T, T, atol=0.02)


@pytest.mark.parametrize("n", [0, 1, 3, 9])
def test_few_matches_are_no_pose(scene: Scene, rng: np.random.Generator, n: int) -> None:
    pose = Fgr()(scene, planted(0, n=n, inlier_ratio=1.0)[0], rng)
    assert not pose.found
    assert pose.inliers is not None
    assert pose.inliers.shape == (n,)
    assert any(f"it got {n}" in note for note in scene.notes)


def test_matches_that_do_not_agree_are_no_pose(scene: Scene, rng: np.random.Generator) -> None:
    # Open3D answers with the identity here, and calls it a result.
    pose = Fgr()(scene, planted(0, n=12, inlier_ratio=0.0)[0], rng)
    assert not pose.found


def test_aligned_clouds_are_a_pose(scene: Scene, rng: np.random.Generator) -> None:
    points = planted(0, n=100)[0].source
    pose = Fgr()(scene, Correspondences.of(points, points), rng)
    assert pose.found
    np.testing.assert_allclose(pose.T, np.eye(4), atol=1e-6)


SCRIPT = """
import hashlib, sys
import numpy as np
sys.path[:0] = [{root!r}, {here!r}]
from made_matches import planted
from hybridreg import testing
from hybridreg.classical.fgr import Fgr
scene = testing.sample_scene()[0]
digest = hashlib.sha256()
for seed in range(3):
    digest.update(Fgr()(scene, planted(seed, n=3000)[0], np.random.default_rng(seed)).T.tobytes())
print(digest.hexdigest())
"""


def test_the_same_bits_for_any_number_of_threads() -> None:
    script = SCRIPT.format(root=str(ROOT), here=str(Path(__file__).parent))
    digests = set()
    for threads in ("1", "2"):
        env = {**os.environ, "OMP_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": threads}
        run = subprocess.run(
            [sys.executable, "-c", script], env=env, capture_output=True, text=True, check=True
        )
        digests.add(run.stdout.strip())
    assert len(digests) == 1


@pytest.mark.parametrize(
    "fields, message",
    [
        ({"max_distance": -1.0}, "max_distance=-1.0"),
        ({"division_factor": 1.0}, "division_factor=1.0"),
        ({"tuple_scale": 1.0}, "tuple_scale=1.0"),
        ({"iterations": 0}, "iterations=0"),
    ],
)
def test_bad_settings(fields: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Fgr(**fields)  # type: ignore[arg-type]
