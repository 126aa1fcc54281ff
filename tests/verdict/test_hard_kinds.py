# SPDX-License-Identifier: MIT
"""No wrong pose "ok": worlds turned over, mirrored, scaled, or held twice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_places import Made

import hybridreg as hr
from hybridreg.candidates import input_mistakes
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data import hard
from hybridreg.data.hard import is_right
from hybridreg.evidence import views
from hybridreg.evidence.agreement import compare
from hybridreg.evidence.orientation import overturned
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.geometry import se3
from hybridreg.geometry.pose_bounds import PoseBounds
from hybridreg.matches import Correspondences, Pose
from hybridreg.pair import Pair
from hybridreg.pipeline import Pipeline
from hybridreg.resolution import comparable, tolerance
from hybridreg.scene import Scene
from hybridreg.search.repeats import copies
from hybridreg.verdict import judge

NONE = Correspondences.none()


def changed(made: Made, factors: float | np.ndarray) -> Pair:
    """The pair with its source's coordinates multiplied."""
    pair = made.scene.pair
    return Pair.of(pair.source.points * factors, pair.target.points)


def about_middle(made: Made, factor: float) -> np.ndarray:
    """Where the scaled source lies best: its middle where it was."""
    middle = np.median(made.scene.pair.source.points, axis=0)
    T = made.truth.copy()
    T[:3, 3] = se3.apply(made.truth, middle[None])[0] - T[:3, :3] @ (factor * middle)
    return T


def test_a_pose_that_turns_the_world_over_is_failed(crossing: Made) -> None:
    source, target = views.of(crossing.scene).source, views.of(crossing.scene).target
    assert not overturned(source, target, crossing.truth)
    over = se3.from_rt(se3.rotation_about(np.array([np.pi, 0.0, 0.0])), np.array([0.0, 0.0, -3.6]))
    assert overturned(source, target, over @ crossing.truth)
    judgement = judge(crossing.scene, Pose(over @ crossing.truth), NONE)
    assert judgement.verdict == "failed"
    assert "turns the world upside down" in judgement.reasons[0]


def test_a_pose_that_puts_a_sensor_under_the_ground_is_failed(crossing: Made) -> None:
    sunk = se3.from_rt(np.eye(3), np.array([0.0, 0.0, -5.0])) @ crossing.truth
    assert overturned(views.of(crossing.scene).source, views.of(crossing.scene).target, sunk)


def test_where_gravity_is_unknown_nothing_is_turned_over(crossing: Made) -> None:
    scene = VoxelGrid()(replace(crossing.scene.pair, gravity="unknown"))
    over = se3.from_rt(se3.rotation_about(np.array([np.pi, 0.0, 0.0])), np.array([0.0, 0.0, -3.6]))
    assert not overturned(views.of(scene).source, views.of(scene).target, over @ crossing.truth)
    with pytest.raises(ValueError, match="gravity"):
        Pair.of(np.eye(3), np.eye(3), gravity="down")


@pytest.mark.parametrize("factor", [0.93, 0.95, 0.97, 1.03, 1.05])
def test_a_source_of_another_size_is_never_ok_and_its_size_is_told(crossing: Made, factor: float) -> None:
    scene = VoxelGrid()(changed(crossing, factor))
    pose = Pose(about_middle(crossing, factor))
    scale, gain, _ = PoseEvidence(views.of(scene), pose.T).size
    assert scale == pytest.approx(1.0 / factor, abs=0.01)
    assert gain > 0.2
    judgement = judge(scene, pose, NONE)
    assert judgement.verdict != "ok"
    assert any(f"multiplied by {scale:.3f}" in reason for reason in judgement.reasons)


@pytest.mark.parametrize("place", ["crossing", "fan"])
def test_the_right_size_is_not_doubted(place: str, request: pytest.FixtureRequest) -> None:
    made: Made = request.getfixturevalue(place)
    assert PoseEvidence(views.of(made.scene), made.truth).size.gain < 0.2


def test_a_map_that_holds_a_place_twice_shows_its_other_copy(crossing: Made) -> None:
    pair = crossing.scene.pair
    copy = se3.from_rt(se3.rotation_about(np.array([0.0, 0.0, np.radians(1.5)])), np.array([2.5, 0.4, 0.0]))
    twice = np.vstack([pair.target.points, se3.apply(copy, pair.target.points)])
    scene = VoxelGrid()(Pair.of(pair.source.points, twice))
    both = views.of(scene)
    found = copies(both, crossing.truth, compare(both, crossing.truth).axes)
    off = [se3.inverse(copy @ crossing.truth) @ T for T in found]
    assert min(np.linalg.norm(T[:3, 3]) for T in off) < 1.0
    judgement = judge(scene, Pose(crossing.truth), NONE)
    near = [np.linalg.norm((se3.inverse(copy @ crossing.truth) @ T)[:3, 3]) for T in judgement.rivals]
    assert judgement.verdict != "ok"
    assert min(near) < 0.5


def test_a_rival_that_lies_little_behind_is_told_and_leaves_no_certainty() -> None:
    # Shelves like those beside them: the pose found is one bay off, and the right one lies 2.95 behind.
    made = hard.sample("rack", 34)
    result = hr.register(made.source, made.target)
    assert result.verdict == "doubtful"
    assert any(is_right(made, T) for T in [result.transformation, *result.rivals])


def test_a_mirrored_source_is_named(crossing: Made) -> None:
    told = input_mistakes.explanations(VoxelGrid()(changed(crossing, np.array([1.0, -1.0, 1.0]))))
    assert told
    assert "mirror image" in told[0]


def test_the_mirror_image_of_part_of_a_room_is_named_though_another_pose_fits() -> None:
    # Two walls and a floor, seen by depth cameras: their mirror image fits at 0.98 without it.
    made = hard.sample("mirrored", 414)
    result = hr.register(made.source, made.target)
    assert result.verdict != "ok"
    assert "mirror image" in result.reasons[0]


@pytest.mark.parametrize(
    "factor, unit", [(1000.0, "millimetres"), (100.0, "centimetres"), (1 / 0.3048, "feet")]
)
def test_another_unit_is_named_with_its_cloud(crossing: Made, factor: float, unit: str) -> None:
    told = input_mistakes.explanations(VoxelGrid()(changed(crossing, factor)))
    assert told
    assert f"the source is taken to be in {unit}" in told[0]
    pair = changed(crossing, factor)
    told = input_mistakes.explanations(VoxelGrid()(Pair(source=pair.target, target=pair.source)))
    assert told
    assert f"the target is taken to be in {unit}" in told[0]


def test_a_pose_beyond_the_bounds_is_told_before_other_mistakes(crossing: Made) -> None:
    pair = crossing.scene.pair
    bounds = PoseBounds(centre=np.zeros(3), start=np.zeros(3) + 500.0, max_translation=1.0)
    reasons = Pipeline.preset("default").run(replace(pair, bounds=bounds)).reasons
    assert any("shut out" in reason for reason in reasons)
    assert not any("mirror" in reason for reason in reasons)


def test_a_right_pair_is_no_mistake(crossing: Made, elsewhere: Scene) -> None:
    assert comparable(crossing.scene.pair.source, crossing.scene.pair.target)
    assert input_mistakes.explanations(crossing.scene) == []
    assert input_mistakes.explanations(elsewhere) == []


def test_the_tolerance_follows_the_size_of_the_scene(crossing: Made) -> None:
    pair = crossing.scene.pair
    assert tolerance(pair.source, pair.target) == (2.0, 0.5)
    small = Pair.of(pair.source.points / 500.0, pair.target.points / 500.0)
    assert tolerance(small.source, small.target).metres < 0.005


def test_the_other_copy_of_a_doubled_map_is_found_where_only_a_slide_along_it_shows_it() -> None:
    # Of the bird's-eye peaks none lay near it.
    doubled = hard.sample("doubled", 207)
    result = Pipeline.preset("default").run(Pair.of(doubled.source, doubled.target))
    assert is_right(doubled, result.transformation)
    assert result.verdict == "doubtful"
    assert any(is_right(doubled, T) for T in result.rivals)


@pytest.mark.parametrize("seed", [774, 792])
def test_an_object_that_looks_alike_after_a_turn_is_not_ok_the_wrong_way_round(seed: int) -> None:
    made = hard.sample("object", seed)
    result = hr.register(made.source, made.target)
    assert is_right(made, result.transformation) or result.verdict != "ok"


@pytest.mark.parametrize("kind, seed", [("depth-room", 708), ("building", 714)])
def test_a_rival_that_is_likelier_becomes_the_pose(kind: str, seed: int) -> None:
    made = hard.sample(kind, seed)
    assert is_right(made, hr.register(made.source, made.target).transformation)


@pytest.mark.parametrize("seed", [714, 992])
def test_a_small_object_is_not_compared_more_finely_than_it_was_seen(seed: int) -> None:
    # Points 0.8 and 1.2 mm apart; a sixtieth of the extent is less.
    made = hard.sample("object", seed)
    result = hr.register(made.source, made.target)
    assert is_right(made, result.transformation)
    assert result.verdict != "failed"


@pytest.mark.parametrize("seed", [428, 485])
def test_a_right_pose_of_high_support_has_not_failed(seed: int) -> None:
    made = hard.sample(
        "building", seed
    )  # a scan in one room, in the map of a floor: little is visible from either
    result = hr.register(made.source, made.target)
    assert is_right(made, result.transformation)
    assert result.verdict != "failed"
