# SPDX-License-Identifier: MIT
"""ICP, GICP and KISS-ICP from a start that is nearly right, and from starts that are not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_gicp

import hybridreg as hr
from hybridreg.classical.icp import plane_step, point_step
from hybridreg.geometry import se3
from hybridreg.matches import Pose
from hybridreg.scene import Scene

STAGES = [hr.Icp(), hr.Icp(kind="plane"), hr.Gicp(), hr.KissIcp()]
START = se3.from_rt(se3.rotation_about(np.array([0.01, -0.01, 0.03])), np.array([0.25, -0.2, 0.1]))


def errors(T: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    return se3.angle_deg((se3.inverse(truth) @ T)[:3, :3]), float(np.linalg.norm(T[:3, 3] - truth[:3, 3]))


@pytest.mark.parametrize("stage", STAGES, ids=repr)
def test_comes_closer(stage: Any, courtyard_scene: tuple[Scene, np.ndarray]) -> None:
    scene, truth = courtyard_scene
    degrees, metres = errors(stage(scene, Pose(START @ truth)).T, truth)
    assert degrees < 0.4, degrees
    assert metres < 0.08, metres


@pytest.mark.parametrize("stage", STAGES, ids=repr)
def test_far_start_ends_in_a_proper_pose(stage: Any, courtyard_scene: tuple[Scene, np.ndarray]) -> None:
    scene, _ = courtyard_scene
    away = se3.from_rt(np.eye(3), np.array([500.0, 0.0, 0.0]))
    se3.check(stage(scene, Pose(away)).T)


@pytest.mark.parametrize("stage", STAGES, ids=repr)
def test_keeps_inliers_and_rivals(stage: Any, courtyard_scene: tuple[Scene, np.ndarray]) -> None:
    scene, truth = courtyard_scene
    rivals = np.stack([np.eye(4), se3.yaw(180)])
    out = stage(scene, Pose(truth, np.ones(3, dtype=bool), rivals))
    assert np.array_equal(out.rivals, rivals)
    assert out.inliers is not None
    assert out.inliers.sum() == 3


def test_point_step_is_exact_for_a_rigid_motion() -> None:
    rng = np.random.default_rng(0)
    p = rng.normal(size=(40, 3))
    q = se3.apply(START, p)
    assert np.allclose(se3.exp(point_step(p, q)), START, atol=1e-9)


def test_plane_step_converges_and_leaves_an_open_direction_alone() -> None:
    rng = np.random.default_rng(0)
    p = np.column_stack([rng.uniform(-5, 5, (200, 2)), np.zeros(200)])
    up = np.tile([0.0, 0.0, 1.0], (200, 1))
    twist = plane_step(p + [0.3, 0.2, 0.5], p, up)
    assert twist[5] == pytest.approx(-0.5, abs=1e-9)
    assert np.allclose(twist[[2, 3, 4]], 0.0, atol=1e-9), "nothing holds a plane's yaw, x and y"


def test_icp_refuses_an_unknown_kind() -> None:
    with pytest.raises(ValueError, match="kind: expected one of 'point', 'plane'"):
        hr.Icp(kind="line")  # type: ignore[arg-type]


def test_gicp_keeps_the_start_rather_than_lose_overlap(courtyard_scene: tuple[Scene, np.ndarray]) -> None:
    scene, truth = courtyard_scene
    from hybridreg.classical.gicp import not_worse

    slid = se3.from_rt(np.eye(3), np.array([3.0, 0.0, 0.0])) @ truth
    assert np.array_equal(not_worse(scene, Pose(truth), slid).T, truth)
    assert np.array_equal(not_worse(scene, Pose(slid), truth).T, truth)
    assert np.array_equal(not_worse(scene, Pose(truth), np.full((4, 4), np.nan)).T, truth)


@pytest.mark.parametrize("stage", [hr.Icp(), hr.Gicp()])
def test_a_refined_pose_remembers_how_it_was_found(
    stage: hr.Icp | hr.Gicp, courtyard_scene: tuple[Scene, np.ndarray]
) -> None:
    scene, truth = courtyard_scene
    found = stage(scene, Pose(truth, rivals=np.eye(4)[None], found_by=3))
    assert found.found_by == 3
    assert len(found.rivals) == 1


def test_gicp_does_not_ask_for_partners_of_points_far_away(courtyard_scene: tuple[Scene, np.ndarray]) -> None:
    scene, truth = courtyard_scene
    rng = np.random.default_rng(0)
    elsewhere = rng.uniform(-20.0, 20.0, (4_000, 3)) + [300.0, 0.0, 0.0]
    longer = hr.VoxelGrid(voxel=scene.source.spacing)(
        hr.Pair.of(np.concatenate([scene.pair.source.points, elsewhere]), scene.pair.target)
    )
    asked = _asked(longer, Pose(START @ truth))
    assert 0 < max(asked) <= min(_asked(scene, Pose(START @ truth)))


def test_gicp_leaves_a_pose_without_any_partner_as_it_is(courtyard_scene: tuple[Scene, np.ndarray]) -> None:
    scene, _ = courtyard_scene
    away = se3.from_rt(np.eye(3), np.array([500.0, 0.0, 0.0]))
    assert _asked(scene, Pose(away)) == []
    assert np.array_equal(hr.Gicp()(scene, Pose(away)).T, away)


@pytest.mark.parametrize(
    ("converged", "iterations", "rounds"), [(True, 0, 2), (True, 1, 3), (False, 0, 3), (False, 29, 3)]
)
def test_gicp_leaves_out_the_middle_round_of_what_rested_at_the_first_step(
    monkeypatch: pytest.MonkeyPatch,
    courtyard_scene: tuple[Scene, np.ndarray],
    converged: bool,
    iterations: int,
    rounds: int,
) -> None:
    scene, truth = courtyard_scene
    reaches = []

    def align(target: Any, source: Any, tree: Any, **options: Any) -> Any:
        reaches.append(options["max_correspondence_distance"])
        return SimpleNamespace(T_target_source=truth, converged=converged, iterations=iterations)

    monkeypatch.setattr(small_gicp, "align", align)
    hr.Gicp(max_distances=(3.0, 2.0, 1.0))(scene, Pose(truth))
    assert len(reaches) == rounds
    assert reaches[-1] == 1.0


def test_gicp_with_one_step_a_round_takes_every_round(courtyard_scene: tuple[Scene, np.ndarray]) -> None:
    scene, truth = courtyard_scene
    align, found = small_gicp.align, []

    def noted(*clouds: Any, **options: Any) -> Any:
        found.append(align(*clouds, **options))
        return found[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(small_gicp, "align", noted)
        hr.Gicp(iterations=1)(scene, Pose(START @ truth))
    assert not found[0].converged
    assert found[0].iterations == 0  # what a reader takes for rest
    assert len(found) == 3


def test_kiss_icp_stays_where_two_clouds_are_the_same(courtyard_scene: tuple[Scene, np.ndarray]) -> None:
    points = courtyard_scene[0].pair.source.points
    same = hr.VoxelGrid()(hr.Pair.of(points, points))
    moved = hr.KissIcp()(same, Pose(np.eye(4))).T
    assert np.linalg.norm(moved[:3, 3]) < 0.003
    assert se3.angle_deg(moved[:3, :3]) < 0.05


@pytest.mark.parametrize("away", [0.5, 1.3, 2.4])
def test_kiss_icp_finds_partners_three_sigmas_away_on_a_fine_map(
    courtyard_scene: tuple[Scene, np.ndarray], away: float
) -> None:
    points = courtyard_scene[0].pair.source.points
    same = hr.VoxelGrid(voxel=0.4)(hr.Pair.of(points, points))
    start = se3.from_rt(np.eye(3), np.array([0.8, 0.5, 0.3]) * away)
    found = hr.KissIcp(sigma=1.0, voxel=0.5)(same, Pose(start)).T
    assert np.linalg.norm(found[:3, 3]) < 0.02


def test_kiss_icp_takes_a_pose_of_single_precision(courtyard_scene: tuple[Scene, np.ndarray]) -> None:
    scene, truth = courtyard_scene
    degrees, metres = errors(hr.KissIcp()(scene, Pose(truth.astype(np.float32))).T, truth)
    assert degrees < 0.4
    assert metres < 0.08


def _asked(scene: Scene, start: Pose) -> list[int]:
    # Source points in each of small_gicp's rounds.
    align, asked = small_gicp.align, []

    def counted(target: Any, source: Any, *others: Any, **options: Any) -> Any:
        asked.append(source.size())
        return align(target, source, *others, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(small_gicp, "align", counted)
        hr.Gicp(voxel=0.3)(scene, start)
    return asked
