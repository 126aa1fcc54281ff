# SPDX-License-Identifier: MIT
from __future__ import annotations

import re
from itertools import combinations

import numpy as np
import pytest
from made_places import Made, make

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data import open_dataset
from hybridreg.data.hard import box_world
from hybridreg.eval.score import metrics
from hybridreg.evidence import views
from hybridreg.evidence.log_odds import FAILED
from hybridreg.frames import lower_pose
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Pose
from hybridreg.scene import Scene
from hybridreg.search.ranking import differs
from hybridreg.search.settle import settle
from hybridreg.verdict import Judgement, judge
from hybridreg.verdict.training.near_misses import ASIDE, aside, table

NONE = Correspondences.none()


def settled(scene: Scene, T: np.ndarray) -> np.ndarray:
    """A wrong pose where it fits best: what a registration would return."""
    return settle(views.of(scene), T)


def words(judgement: Judgement) -> str:
    return " | ".join(judgement.reasons)


@pytest.mark.parametrize("place", ["crossing", "fan"])
def test_the_true_pose_is_ok(place: str, request: pytest.FixtureRequest) -> None:
    made: Made = request.getfixturevalue(place)
    judgement = judge(made.scene, Pose(made.truth), NONE)
    assert judgement.verdict == "ok", words(judgement)
    assert judgement.confidence >= 0.95
    assert len(judgement.rivals) == 0


@pytest.mark.parametrize("place", ["crossing", "fan"])
def test_half_a_turn_is_not_ok(place: str, request: pytest.FixtureRequest) -> None:
    made: Made = request.getfixturevalue(place)
    judgement = judge(made.scene, Pose(settled(made.scene, se3.yaw(180.0) @ made.truth)), NONE)
    assert judgement.verdict == "failed", words(judgement)
    assert "free space is violated" in judgement.reasons[0]


@pytest.mark.parametrize("metres", [-10.0, -5.0, 5.0, 10.0])
def test_a_slide_along_the_street_is_not_ok(crossing: Made, metres: float) -> None:
    slid = settled(crossing.scene, se3.from_rt(np.eye(3), np.array([metres, 0.0, 0.0])) @ crossing.truth)
    if np.linalg.norm((slid - crossing.truth)[:3, 3]) < 1.0:
        pytest.skip("it slid back")
    assert judge(crossing.scene, Pose(slid), NONE).verdict != "ok"


@pytest.mark.parametrize(
    ("tier", "number"), [("near", 2), ("near", 3), ("far", 0), ("far", 5), ("degenerate", 1)]
)
def test_a_pose_just_beyond_the_tolerance_is_not_ok(tier: str, number: int) -> None:
    # One that nobody refined lies so near the right one that all evidence speaks for it.
    labelled = open_dataset(f"sim:val/{tier}")[number]
    scene, truth = VoxelGrid()(labelled.pair), lower_pose(labelled.T_target_source, labelled.pair)
    rng, middle = np.random.default_rng(number), views.of(scene).middle[0]
    for degrees, metres in ASIDE[1:]:
        judgement = judge(scene, Pose(aside(truth, middle, degrees, metres, rng)), NONE)
        assert judgement.verdict != "ok", (degrees, metres, words(judgement))


def test_a_right_pose_that_nobody_refined_is_not_failed() -> None:
    labelled = open_dataset("sim:val/degenerate#60")[56]
    scene, truth = VoxelGrid()(labelled.pair), lower_pose(labelled.T_target_source, labelled.pair)
    middle = views.of(scene).middle[0]
    near = [aside(truth, middle, degrees, 0.2, np.random.default_rng(7)) for degrees in (0.5, 1.0, 1.5)]
    told = [judge(scene, Pose(T), NONE) for T in near]
    assert [each.verdict for each in told].count("failed") == 0
    assert any(each.confidence == FAILED and "refine it" in each.reasons[0] for each in told)


def test_near_misses_are_counted_by_how_far_they_lie() -> None:
    lines = table([(ASIDE[1], True), (ASIDE[1], False), (ASIDE[3], False)]).splitlines()
    assert lines[3] == "| 2.6 | 0 | 2 | 1 |"
    assert lines[5] == "| 0 | 0.6 | 1 | 0 |"


def test_how_far_the_surfaces_draw_a_pose_is_told() -> None:
    labelled = open_dataset("sim:val/near")[2]
    scene, truth = VoxelGrid()(labelled.pair), lower_pose(labelled.T_target_source, labelled.pair)
    pose = aside(truth, views.of(scene).middle[0], 0.0, 0.6, np.random.default_rng(0))
    judgement = judge(scene, Pose(pose), NONE)
    assert judgement.verdict == "doubtful"
    assert re.match(r"the surfaces draw the pose 0\.\d deg and 0\.(5|6)\d? m away", judgement.reasons[0])


def test_another_street_is_failed_wherever_it_is_laid(elsewhere: Scene) -> None:
    for yaw_deg in range(0, 360, 60):
        # The source of this scene stood upright, at the target's height.
        judgement = judge(elsewhere, Pose(settled(elsewhere, se3.yaw(float(yaw_deg)))), NONE)
        assert judgement.verdict == "failed", (yaw_deg, words(judgement))


def test_a_corridor_is_doubtful_and_its_direction_named(corridor: Made) -> None:
    judgement = judge(corridor.scene, Pose(corridor.truth), NONE)
    assert judgement.verdict != "ok"
    assert "along x of the target (1.00" in words(judgement)


def test_a_symmetric_room_has_its_double_among_the_rivals() -> None:
    room = box_world.World(ceiling=3.0)
    for x, y, w, d in ((5, 0, 0.2, 6), (-5, 0, 0.2, 6), (0, 3, 10, 0.2), (0, -3, 10, 0.2)):
        room.box(x, y, (w, d, 3.0))
    made = make(
        room,
        "rings32",
        "rings64",
        box_world.sensor_pose(0.6, 0.2, 1.3, 30),
        box_world.sensor_pose(0, 0, 1.3, 0),
    )
    judgement = judge(made.scene, Pose(made.truth), NONE)
    double = se3.yaw(180.0) @ made.truth
    assert judgement.verdict != "ok"
    assert "another pose explains the data" in words(judgement)
    assert min(np.abs(rival - double).max() for rival in judgement.rivals) < 0.2


def test_a_rival_of_the_estimator_that_fits_better_is_believed(crossing: Made) -> None:
    wrong = settled(crossing.scene, se3.from_rt(np.eye(3), np.array([6.0, 0.0, 0.0])) @ crossing.truth)
    judgement = judge(crossing.scene, Pose(wrong, rivals=crossing.truth[None]), NONE)
    assert judgement.verdict == "failed"
    assert "explains the data better" in words(judgement)
    assert np.abs(judgement.rivals[0] - crossing.truth).max() < 0.2


def test_a_rival_that_stopped_on_its_way_to_the_pose_is_none() -> None:
    # 5.5 degrees off, on a field that hardly holds a turn about the vertical.
    made = open_dataset("sim:train/degenerate#32")[31]
    result = hr.register(made.pair.source, made.pair.target)
    assert metrics.rre_deg(result.transformation, made.T_target_source) < 0.5
    assert result.verdict != "failed"
    assert result.evidence["rival_margin"] < -3.5
    # Half a turn off the field looks much alike, which is told.
    assert all(metrics.rre_deg(T, made.T_target_source) > 90.0 for T in result.rivals)


def test_two_rivals_that_meet_are_one() -> None:
    trace = hr.Pipeline.preset("default").trace(open_dataset("sim:val/mid")[4].pair)
    both, found = views.of(trace.scene), trace.refined.weighed.rivals
    assert len(found) == 4
    middle = se3.apply(trace.refined.T, both.middle)[0]
    assert all(differs(one.T, other.T, middle, both.spacing) for one, other in combinations(found, 2))


def test_no_pose_is_failed(crossing: Made) -> None:
    judgement = judge(crossing.scene, Pose.unknown(), NONE)
    assert judgement.verdict == "failed"
    assert judgement.confidence == 0.0
    assert judgement.reasons == (
        "no pose was found: the estimator had nothing to work with, and returned the identity",
    )


def test_a_pose_that_lays_the_clouds_apart_is_failed(crossing: Made) -> None:
    far = se3.from_rt(np.eye(3), np.array([0.0, 0.0, 5000.0]))
    judgement = judge(crossing.scene, Pose(far), NONE)
    assert judgement.verdict == "failed"
    assert judgement.overlay.of_source.fitness == judgement.overlay.of_target.fitness == 0.0
    assert all(np.isfinite(value) for value in judgement.evidence.values())


def test_evidence_has_the_same_keys_whatever_the_pose(crossing: Made, corridor: Made) -> None:
    poses = [
        judge(crossing.scene, Pose(crossing.truth), NONE),
        judge(crossing.scene, Pose.unknown(), NONE),
        judge(corridor.scene, Pose(corridor.truth), NONE),
    ]
    assert len({tuple(p.evidence) for p in poses}) == 1
    assert all(type(value) is float for p in poses for value in p.evidence.values())


def test_the_verdict_does_not_hang_on_the_pipelines_voxel(crossing: Made) -> None:
    pair = crossing.scene.pair
    scores = [
        judge(VoxelGrid(voxel=voxel)(pair), Pose(crossing.truth), NONE).confidence
        for voxel in (0.25, 0.5, 1.5)
    ]
    assert min(scores) >= 0.95


def test_judging_twice_gives_the_same(crossing: Made) -> None:
    again = VoxelGrid()(crossing.scene.pair)
    first, second = (judge(s, Pose(crossing.truth), NONE) for s in (crossing.scene, again))
    assert first.evidence == second.evidence
    assert first.reasons == second.reasons


def test_matches_that_agree_are_counted(crossing: Made) -> None:
    source = crossing.scene.source.points[:50]
    target = se3.apply(crossing.truth, source) + np.where(np.arange(50) < 20, 0.0, 9.0)[:, None]
    judgement = judge(crossing.scene, Pose(crossing.truth), Correspondences.of(source, target))
    assert judgement.evidence["matches_agreeing"] == 20.0


def test_fitness_is_open3ds(crossing: Made) -> None:
    from hybridreg.runtime.open3d import load_open3d

    try:
        o3d = load_open3d()
    except ImportError as error:
        pytest.skip(str(error))
    judgement = judge(crossing.scene, Pose(crossing.truth), NONE)
    pair = crossing.scene.pair
    points = (pair.source.points.copy(), pair.target.points.copy())
    clouds = [o3d.geometry.PointCloud(o3d.utility.Vector3dVector(p)) for p in points]
    distance = judgement.overlay.max_distance
    theirs = o3d.pipelines.registration.evaluate_registration(*clouds, distance, crossing.truth)
    assert distance == 2.0 * crossing.scene.spacing
    assert judgement.overlay.of_source.fitness == pytest.approx(theirs.fitness, abs=1e-12)
    assert judgement.overlay.of_source.inlier_rmse == pytest.approx(theirs.inlier_rmse, abs=1e-9)
    assert len(judgement.overlay.of_source.correspondence_set) == len(theirs.correspondence_set)
    back = o3d.pipelines.registration.evaluate_registration(
        *clouds[::-1], distance, se3.inverse(crossing.truth)
    )
    assert judgement.overlay.of_target.fitness == pytest.approx(back.fitness, abs=1e-12)
