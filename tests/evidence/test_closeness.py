# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from made_places import Made

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.evidence import views
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.evidence.surface_distance import closeness, settle_closely
from hybridreg.geometry import se3
from hybridreg.matches import Pose
from hybridreg.search import ranking
from hybridreg.search.hypothesis import Hypothesis
from hybridreg.search.ranking import counted, told_apart
from hybridreg.search.settle import best_first, second_look
from hybridreg.verdict import weigh


def moved(metres: tuple[float, float, float], yaw_deg: float, truth: np.ndarray) -> np.ndarray:
    return se3.from_rt(np.eye(3), np.array(metres)) @ se3.yaw(yaw_deg) @ truth


def hypothesis(made: Made, T: np.ndarray, by_surfaces: float) -> Hypothesis:
    return Hypothesis(at=PoseEvidence(views.of(made.scene), T), by_surfaces=by_surfaces)


def wrong_by(T: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    step = T @ se3.inverse(truth)
    return se3.angle_deg(step[:3, :3]), float(np.linalg.norm(T[:3, 3] - truth[:3, 3]))


@pytest.mark.parametrize("metres", [(0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.2), (3.0, 1.0, 0.0)])
def test_points_lie_closest_where_the_clouds_lay(crossing: Made, metres: tuple[float, float, float]) -> None:
    right = closeness(views.of(crossing.scene).fine, crossing.truth)
    assert right > 1.0
    assert closeness(views.of(crossing.scene).fine, moved(metres, 0.0, crossing.truth)) < right - 0.2


def test_apart_they_are_as_close_as_chance(crossing: Made) -> None:
    assert closeness(views.of(crossing.scene).fine, moved((1e4, 0.0, 0.0), 0.0, crossing.truth)) == 0.0


def test_a_pair_turned_round_is_as_close(crossing: Made) -> None:
    pair = crossing.scene.pair
    back = VoxelGrid()(hr.Pair(source=pair.target, target=pair.source))
    turned = closeness(views.of(back).fine, se3.inverse(crossing.truth))
    assert turned == pytest.approx(closeness(views.of(crossing.scene).fine, crossing.truth), abs=1e-6)


def test_points_nearly_all_in_one_place_raise_nothing() -> None:
    heap = np.ones((50, 3))
    heap[:2] = [[1000.0, 0.0, 0.0], [0.0, 1000.0, 0.0]]
    scene = VoxelGrid(voxel=0.1)(hr.Pair.of(heap, heap))
    assert np.isfinite(closeness(views.of(scene).fine, np.eye(4)))
    assert np.isfinite(settle_closely(views.of(scene).fine, np.eye(4))).all()


def test_a_pose_some_decimetres_off_settles_to_the_centimetre(crossing: Made) -> None:
    settled = settle_closely(views.of(crossing.scene).fine, moved((0.15, -0.1, 0.05), 0.4, crossing.truth))
    degrees, metres = wrong_by(settled, crossing.truth)
    assert degrees < 0.15
    assert metres < 0.03


def test_where_nothing_is_near_a_pose_stays(crossing: Made) -> None:
    far = moved((1e4, 0.0, 0.0), 0.0, crossing.truth)
    assert np.array_equal(settle_closely(views.of(crossing.scene).fine, far), far)


def test_of_poses_that_surfaces_support_alike_the_closest_comes_first(crossing: Made) -> None:
    poses = [moved((0.2, 0.0, 0.0), 0.0, crossing.truth), crossing.truth]
    told = told_apart([hypothesis(crossing, T, 0.0) for T in poses])
    assert told[1].closeness == 0.0 > told[0].closeness
    assert told[1].log_odds > told[0].log_odds
    ranked = counted(crossing.scene, told, [])
    assert np.array_equal(ranked[0].T, crossing.truth)


def test_a_second_look_settles_closely_what_the_first_took_for_one_of_many(crossing: Made) -> None:
    scene = VoxelGrid()(crossing.scene.pair)
    starts = [moved((x, 0.0, 0.0), 0.0, crossing.truth) for x in (-9.0, 0.5, 9.0)]
    best_first(scene, starts)
    again = second_look(scene)
    assert 1 < len(again) <= len(starts)
    assert min(wrong_by(one.T, crossing.truth)[1] for one in again) < 0.03


def test_without_a_first_look_there_is_no_second(crossing: Made) -> None:
    assert second_look(VoxelGrid()(crossing.scene.pair)) == []


@pytest.mark.parametrize("by_surfaces", [(0.0, -9.0), (0.0, -20.0), (0.0,)])
def test_what_is_decided_already_is_not_looked_at_so_closely(
    crossing: Made, by_surfaces: tuple[float, ...]
) -> None:
    found = [
        hypothesis(crossing, moved((k, 0.0, 0.0), 0.0, crossing.truth), s) for k, s in enumerate(by_surfaces)
    ]
    assert told_apart(found) == found
    assert told_apart([]) == []


def test_the_evidence_tells_how_much_closer_a_rival_lies(
    crossing: Made, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ranking, "_CLOSENESS_DECIDES", np.inf)
    wrong = moved((3.0, 1.0, 0.0), 0.0, crossing.truth)
    told = [
        weigh(VoxelGrid()(crossing.scene.pair), Pose.ranked(poses)).evidence.closeness
        for poses in ([wrong, crossing.truth], [crossing.truth, wrong])
    ]
    assert told[0] < -0.2 < told[1] == 0.0
