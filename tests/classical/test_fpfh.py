# SPDX-License-Identifier: MIT
from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from made_matches import street
from needs_open3d import needs_open3d

import hybridreg as hr
from hybridreg.classical.fpfh import Fpfh
from hybridreg.classical.ransac import Ransac
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Overlap
from hybridreg.scene import Scene
from hybridreg.testing import check_stage

pytestmark = needs_open3d
ROOT = Path(__file__).resolve().parents[2]

TURN = se3.from_rt(se3.yaw(120.0)[:3, :3], np.array([1.0, -2.0, 0.3]))


@pytest.fixture(scope="module")
def turned(make_scene: Callable[..., Scene]) -> Scene:
    """A street seen twice: other samples of the same surfaces, the source turned."""
    points = street(0, 24_000)
    rng = np.random.default_rng(0)
    half = rng.permutation(len(points)) < len(points) // 2
    return make_scene(se3.apply(se3.inverse(TURN), points[half]), points[~half])


def full(scene: Scene) -> Overlap:
    return Overlap.full(len(scene.source), len(scene.target))


def right(matches: Correspondences, within: float = 0.6) -> np.ndarray:
    return np.linalg.norm(se3.apply(TURN, matches.source) - matches.target, axis=1) < within


def test_conforms() -> None:
    check_stage(Fpfh())


def test_matches_find_the_pose(turned: Scene) -> None:
    matches = Fpfh()(turned, full(turned))
    assert right(matches).mean() > 0.1
    error = se3.inverse(TURN) @ Ransac()(turned, matches, np.random.default_rng(0)).T
    assert se3.angle_deg(error[:3, :3]) < 2.0
    assert np.linalg.norm(error[:3, 3]) < 0.5


def test_matches_of_the_same_two_cells_are_a_group(turned: Scene) -> None:
    matches = Fpfh(cell=6.0)(turned, full(turned))
    assert matches.group is not None
    cells = [
        (*np.floor(p / 6.0).astype(int), *np.floor(q / 6.0).astype(int))
        for p, q in zip(matches.source, matches.target, strict=True)
    ]
    same = np.array([[a == b for b in cells] for a in cells])
    assert np.array_equal(same, matches.group[:, None] == matches.group[None])
    finer = Fpfh(cell=2.0)(turned, full(turned)).group
    assert finer is not None
    assert finer.max() > matches.group.max()


def test_local_to_global_estimation_follows_it(turned: Scene) -> None:
    pytest.importorskip("torch")
    from hybridreg.learned.stages.lgr import Lgr

    matches = Fpfh()(turned, full(turned))
    error = se3.inverse(TURN) @ Lgr()(turned, matches, np.random.default_rng(0)).T
    assert se3.angle_deg(error[:3, :3]) < 3.0
    assert np.linalg.norm(error[:3, 3]) < 1.0


def test_rows_are_those_of_the_levels_and_unique_both_ways(turned: Scene) -> None:
    matches = Fpfh()(turned, full(turned))
    assert matches.source_index is not None
    assert matches.target_index is not None
    np.testing.assert_array_equal(turned.source.points[matches.source_index], matches.source)
    np.testing.assert_array_equal(turned.target.points[matches.target_index], matches.target)
    assert len(np.unique(matches.source_index)) == len(np.unique(matches.target_index)) == len(matches)


def test_mutual_leaves_better_matches_and_ratio_some_of_them(turned: Scene) -> None:
    kept = [
        Fpfh(mutual=mutual, ratio=ratio)(turned, full(turned))
        for mutual, ratio in ((False, None), (True, None), (True, 0.8))
    ]
    assert len(kept[0]) > len(kept[1]) > len(kept[2]) > 0
    assert right(kept[0]).mean() < right(kept[1]).mean()
    # Whether the ratio test helps hangs on the scene: on points a voxel apart the second nearest is often right too.
    pairs = [{*zip(k.source_index.tolist(), k.target_index.tolist(), strict=True)} for k in kept]
    assert pairs[2] < pairs[1] < pairs[0]


def test_only_points_in_the_overlap_are_matched(turned: Scene) -> None:
    source = turned.source.points[:, 0] > 0.0
    target = turned.target.points[:, 1] > 0.0
    matches = Fpfh()(turned, Overlap(0.8 * source, 0.8 * target))
    assert len(matches) > 50
    assert source[matches.source_index].all()
    assert target[matches.target_index].all()


def test_an_overlap_too_small_is_ignored_and_noted(turned: Scene) -> None:
    few = np.zeros(len(turned.source))
    few[:5] = 1.0
    matches = Fpfh()(turned, Overlap(few, np.ones(len(turned.target))))
    assert len(matches) == len(Fpfh()(turned, full(turned)))
    assert any("only 5 points of the source" in note for note in turned.notes)


def test_many_points_are_thinned_repeatably_and_noted(turned: Scene) -> None:
    matcher = Fpfh(max_points=1000)
    one, two = matcher(turned, full(turned)), matcher(turned, full(turned))
    assert 0 < len(one) <= 1000
    np.testing.assert_array_equal(one.source_index, two.source_index)
    assert any(f"1000 of the {len(turned.source)} points of the source" in note for note in turned.notes)


def test_points_without_neighbours_are_not_matched(make_scene: Callable[..., Scene]) -> None:
    far_apart = np.random.default_rng(0).permutation(np.arange(60.0))[:, None] * [7.0, 11.0, 13.0]
    far_apart[::2, 0] += 300.0
    scene = make_scene(far_apart, far_apart, voxel=0.1)
    assert len(Fpfh()(scene, full(scene))) == 0


def test_takes_clouds_that_nothing_thinned(turned: Scene) -> None:
    pair = turned.pair
    points = (pair.source.points[::4], pair.target.points[::4])
    scene = hr.AllPoints()(hr.Pair.of(*points))
    assert not scene.source.points.flags.writeable
    assert right(hr.Fpfh()(scene, full(scene))).sum() > 50


def test_features_are_computed_once_a_run(turned: Scene) -> None:
    assert Fpfh().features(turned, "source") is Fpfh(ratio=0.9).features(turned, "source")
    assert Fpfh().features(turned, "source") is not Fpfh(radius=1.0).features(turned, "source")


@pytest.mark.parametrize(
    "fields, message",
    [
        ({"radius": 0.0}, "radius=0.0"),
        ({"cell": 0.0}, "cell=0.0"),
        ({"ratio": 1.2}, "ratio=1.2"),
        ({"max_neighbours": 2}, "max_neighbours=2"),
        ({"max_points": 0}, "max_points=0"),
        ({"min_overlap": 1.5}, "min_overlap=1.5"),
    ],
)
def test_bad_settings(fields: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Fpfh(**fields)  # type: ignore[arg-type]


SCRIPT = """
import hashlib, sys
sys.path.insert(0, {root!r})
from hybridreg import Fpfh, testing
from hybridreg.matches import Overlap
scene = testing.sample_scene()[0]
matches = Fpfh(ratio=0.99)(scene, Overlap.full(len(scene.source), len(scene.target)))
assert len(matches) > 100
print(hashlib.sha256(matches.source_index.tobytes() + matches.target_index.tobytes()).hexdigest())
"""


def test_the_same_matches_for_any_number_of_threads() -> None:
    digests = set()
    for threads in ("1", "2"):
        env = {**os.environ, "OMP_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": threads}
        script = SCRIPT.format(root=str(ROOT))
        run = subprocess.run(
            [sys.executable, "-c", script], env=env, capture_output=True, text=True, check=True
        )
        digests.add(run.stdout.strip())
    assert len(digests) == 1
