# SPDX-License-Identifier: MIT
from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import hybridreg as hr
from hybridreg import testing
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences
from hybridreg.scene import Scene

pytest.importorskip("kiss_matcher")
ROOT = Path(__file__).resolve().parents[2]


def run(scene: Scene, **fields: float) -> hr.Pose:
    return hr.KissMatcher(**fields)(scene, Correspondences.none(), np.random.default_rng(0))


def test_finds_the_courtyard_from_any_yaw(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair, truth = courtyard
    turned = hr.Pair.of(se3.apply(se3.yaw(137.0), pair.source.points), pair.target.points)
    pose = run(hr.VoxelGrid(voxel=0.4)(turned))
    error = se3.inverse(truth) @ pose.T @ se3.yaw(137.0)
    assert pose.found
    assert se3.angle_deg(error[:3, :3]) < 5.0
    assert np.linalg.norm(error[:3, 3]) < 1.0


def test_small_things_are_found_as_large_ones(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair, truth = courtyard
    small = hr.Pair.of(pair.source.points / 500.0, pair.target.points / 500.0)
    T = run(hr.VoxelGrid(voxel=0.4 / 500.0)(small)).T
    assert np.linalg.norm(500.0 * T[:3, 3] - truth[:3, 3]) < 1.0
    assert se3.angle_deg(T[:3, :3].T @ truth[:3, :3]) < 5.0


def test_repeats_to_the_last_bit(courtyard_scene: tuple[Scene, np.ndarray]) -> None:
    scene = courtyard_scene[0]
    first = run(scene)
    for _ in range(2):
        again = run(scene)
        assert np.array_equal(first.T, again.T)
        assert np.array_equal(first.rivals, again.rivals)


def test_a_scale_is_a_voxel_in_spacings(courtyard_scene: tuple[Scene, np.ndarray]) -> None:
    scene = courtyard_scene[0]
    assert np.array_equal(run(scene, scale=2.0).T, run(scene, voxel=2.0 * scene.spacing).T)
    assert not np.array_equal(run(scene, scale=2.0).T, run(scene).T)


@pytest.mark.parametrize("fields", [{"voxel": 0.0}, {"scale": -1.0}, {"scale": float("inf")}])
def test_a_size_that_makes_no_sense_is_refused(fields: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="must be a positive number"):
        hr.KissMatcher(**fields)


HOSTILE = """
import sys, numpy as np, hybridreg as hr
from hybridreg.matches import Correspondences
rng = np.random.default_rng(int(sys.argv[2]))
n = int(sys.argv[3])
cloud = {
    "cube": lambda: rng.uniform(0, 20, (n, 3)),
    "line": lambda: np.c_[np.linspace(0, 50, n), rng.normal(0, 0.01, (n, 2))],
    "plane": lambda: np.c_[rng.uniform(0, 30, (n, 2)), rng.normal(0, 1e-3, n)],
    "apart": lambda: rng.uniform(0, 1e4, (n, 3)),
    "twice": lambda: np.repeat(rng.uniform(0, 20, (n // 4, 3)), 4, axis=0),
}[sys.argv[1]]
scene = hr.Scene(
    pair=hr.Pair.of(cloud(), cloud()),
    source=hr.Level(points=cloud(), spacing=0.4), target=hr.Level(points=cloud(), spacing=0.4),
)
pose = hr.KissMatcher()(scene, Correspondences.none(), rng)
print("survived", pose.found)
"""


@pytest.mark.parametrize("kind", ["cube", "line", "plane", "apart", "twice"])
@pytest.mark.parametrize("n", [20, 50, 200])
def test_no_crash_reaches_the_user(kind: str, n: int) -> None:
    """In a process of its own: what is guarded against here is a segmentation fault of the wheel."""
    done = subprocess.run(
        [sys.executable, "-c", HOSTILE, kind, "0", str(n)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "survived" in done.stdout


@pytest.mark.skipif(
    not hasattr(os, "sched_setaffinity"), reason="the wheel's threads can be held on Linux only"
)
def test_twenty_calls_give_the_same_bits() -> None:
    scene, _ = testing.sample_scene()
    cores = os.sched_getaffinity(0)
    assert len({run(scene).T.tobytes() for _ in range(20)}) == 1
    assert os.sched_getaffinity(0) == cores


@pytest.mark.parametrize(("inliers", "found"), [(0, False), (1, False), (2, False), (3, True)])
def test_a_pose_of_fewer_than_three_inliers_is_none(
    monkeypatch: pytest.MonkeyPatch, inliers: int, found: bool
) -> None:
    import kiss_matcher

    class Few(kiss_matcher.KISSMatcher):  # type: ignore[misc]
        """Finds what it finds, and says that so many matches agreed."""

        def get_num_final_inliers(self) -> int:
            return inliers

    monkeypatch.setattr(kiss_matcher, "KISSMatcher", Few)
    scene, _ = testing.sample_scene()
    assert run(scene).found == found
    assert any("found no pose" in note for note in scene.notes) != found
