# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_street import block, pose, seen, two_views

import hybridreg as hr
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences
from hybridreg.testing import check_stage

pytest.importorskip("small_gicp")
angles = st.floats(-180.0, 180.0)


def run(pair: hr.Pair, **fields: object) -> tuple[hr.Pose, hr.Scene]:
    scene = hr.VoxelGrid(voxel=0.5)(pair)
    return hr.BirdsEye(**fields)(scene, Correspondences.none(), np.random.default_rng(0)), scene


def wrong_by(T: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    error = se3.inverse(truth) @ T
    return se3.angle_deg(error[:3, :3]), float(np.linalg.norm(T[:3, 3] - truth[:3, 3]))


@settings(max_examples=12)
@given(yaw=angles, tilt=st.floats(0.0, 20.0), towards=angles, bearing=angles, apart=st.floats(0.0, 25.0))
def test_any_yaw_tilt_and_place_is_recovered(
    yaw: float, tilt: float, towards: float, bearing: float, apart: float
) -> None:
    x, y = apart * np.cos(np.radians(bearing)), apart * np.sin(np.radians(bearing))
    pair, truth = two_views(pose(x, y, yaw, tilt, towards), pose(0.0, 0.0, 0.0, 3.0))
    found, scene = run(pair)
    degrees, metres = wrong_by(found.T, truth)
    assert found.found
    assert degrees < 1.5
    assert metres < 0.4
    assert not any("no ground" in note for note in scene.notes)


@pytest.mark.parametrize("on_its_head", ["source", "target"])
def test_a_sensor_on_its_head(on_its_head: str) -> None:
    tilts = {"source": 3.0, "target": -4.0, on_its_head: 177.0}
    pair, truth = two_views(pose(8.0, -5.0, 70.0, tilts["source"]), pose(0.0, 0.0, 0.0, tilts["target"]))
    degrees, metres = wrong_by(run(pair)[0].T, truth)
    assert degrees < 1.5
    assert metres < 0.4


def test_a_clouds_place_in_its_frame_does_not_matter() -> None:
    # So far from the origin that this is not where the sensor stood: the clouds' middles take its place.
    pair, truth = two_views(pose(8.0, -5.0, 70.0, 0.0), pose(0.0, 0.0, 0.0, 0.0))
    source, target = np.array([900.0, 400.0, 0.0]), np.array([-300.0, 700.0, 2.0])
    found, scene = run(hr.Pair.of(pair.source.points + source, pair.target.points + target))
    back = se3.from_rt(np.eye(3), -target) @ found.T @ se3.from_rt(np.eye(3), source)
    degrees, metres = wrong_by(back, truth)
    assert scene.source.viewpoint is None
    assert degrees < 1.5
    assert metres < 0.4


def test_clouds_that_reach_far_and_fit_badly_still_get_a_second_look() -> None:
    # Two fields 400 m across with a few posts: no pose convinces, and the fine map is at its largest.
    rng = np.random.default_rng(1)
    fields = []
    for _ in range(2):
        flat = np.column_stack([rng.uniform(-200, 200, (20_000, 2)), rng.normal(-1.8, 0.01, 20_000)])
        feet = np.repeat(rng.uniform(-120, 120, (60, 2)), 12, axis=0)
        posts = np.column_stack([feet, np.tile(np.linspace(-1.8, 2.0, 12), 60)])
        fields.append(np.concatenate([flat, posts]))
    found, _ = run(hr.Pair.of(*fields))
    assert found.found


def test_the_best_pose_and_its_rivals_are_told_apart() -> None:
    pair, _ = two_views(pose(10.0, 0.0, 30.0, 0.0), pose(0.0, 0.0, 0.0, 0.0))
    found, _ = run(pair, tries=6)
    assert len(found.rivals) <= 5
    for rival in found.rivals:
        degrees, metres = wrong_by(rival, found.T)
        assert degrees > 0.5 or metres > 0.2


def test_one_try_leaves_no_rival() -> None:
    pair, _ = two_views(pose(10.0, 0.0, 30.0, 0.0), pose(0.0, 0.0, 0.0, 0.0))
    assert run(pair, tries=1)[0].rivals.shape == (0, 4, 4)


def test_repeats_to_the_last_bit() -> None:
    pair, _ = two_views(pose(10.0, 0.0, 30.0, 5.0), pose(0.0, 0.0, 0.0, 0.0))
    one, two = run(pair)[0], run(pair)[0]
    assert np.array_equal(one.T, two.T)
    assert np.array_equal(one.rivals, two.rivals)


def balls(n: int, radius: float, seed: int = 0) -> np.ndarray:
    directions = np.random.default_rng(seed).normal(size=(n, 3))
    return radius * directions / np.linalg.norm(directions, axis=1, keepdims=True)


@pytest.mark.parametrize(("tilt", "word"), [(0.0, "upright"), (180.0, "upside down")])
def test_a_source_without_ground_is_taken_to_hang_as_the_target_does(tilt: float, word: str) -> None:
    target = seen(block(), pose(0.0, 0.0, 0.0, tilt))
    found, scene = run(hr.Pair.of(balls(3000, 12.0), target))
    assert any("no ground found in the source" in note and word in note for note in scene.notes)
    assert not any("found in the target" in note for note in scene.notes)
    # Both frames then point the same way up; GICP may rock a ball, not turn it over.
    assert found.T[2, 2] > 0.0


def test_a_wall_that_passes_for_the_ground_does_not_decide_alone() -> None:
    # The source hangs beside a wall and sees little else: a yard's ground holds fewer points than that plane.
    at_target, at_source = pose(0.0, 0.0, 0.0, 0.0), pose(6.0, 4.0, 50.0, 0.0)
    target, truth = seen(block(), at_target), se3.inverse(at_target) @ at_source
    u = np.random.default_rng(3).uniform(0.0, 1.0, (9_000, 2))
    wall = np.column_stack([-18.0 + 36.0 * u[:, 0], np.full(len(u), 2.5), 4.0 * u[:, 1] - 1.5])
    source = np.concatenate([seen(block(), at_source)[::4], wall])
    found, _ = run(hr.Pair.of(source, target))
    poses = [wrong_by(T, truth) for T in (found.T, *found.rivals)]
    assert min(metres for degrees, metres in poses if degrees < 3.0) < 0.6


@pytest.mark.parametrize(("tilt", "right"), [(2.0, True), (178.0, False)])
def test_levelled_by_the_sensors_frames_only_upright_ones_fit(tilt: float, right: bool) -> None:
    pair, truth = two_views(pose(8.0, -5.0, 70.0, tilt), pose(0.0, 0.0, 0.0, -2.0))
    degrees, metres = wrong_by(run(pair, vertical="sensor")[0].T, truth)
    assert (degrees < 1.5 and metres < 0.4) == right


@pytest.mark.parametrize(("tilt", "searches"), [(1.0, 1), (30.0, 2)])
def test_a_search_by_the_sensors_follows_only_where_a_ground_leans(
    tilt: float, searches: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    pair, _ = two_views(pose(8.0, -5.0, 70.0, tilt), pose(0.0, 0.0, 0.0, 0.0))
    laid: list[object] = []

    def nothing(*args: object) -> list[object]:
        laid.append(args)
        return []

    monkeypatch.setattr(hr.BirdsEye, "_laid", nothing)
    run(pair, vertical="both")
    assert len(laid) == searches


RNG = np.random.default_rng(0)
FLAT = np.column_stack([RNG.uniform(-30, 30, (4000, 2)), RNG.normal(-1.8, 0.01, 4000)])
HOSTILE = {
    "flat field": FLAT,
    "ball": balls(3000, 12.0),
    "tiny": RNG.uniform(-5, 5, (20, 3)),
    "far away": FLAT + [400.0, 0.0, 0.0],
    "one place but one": np.concatenate(
        [np.zeros((40, 3)) + RNG.normal(0, 1e-4, (40, 3)), [[50.0, 3.0, 1.0]]]
    ),
    "street": seen(block(), pose(0.0, 0.0, 0.0, 0.0)),
}


@pytest.mark.parametrize("source", HOSTILE)
@pytest.mark.parametrize("target", HOSTILE)
def test_no_pair_of_clouds_crashes_it(source: str, target: str) -> None:
    found, _ = run(hr.Pair.of(HOSTILE[source], HOSTILE[target]))
    se3.check(found.T)
    assert found.found or np.array_equal(found.T, np.eye(4))


def test_a_flat_field_has_nothing_to_hold_on_to() -> None:
    found, scene = run(hr.Pair.of(FLAT, FLAT[::2]))
    assert not found.found
    assert any("nothing but ground" in note for note in scene.notes)


def test_disjoint_places_give_some_pose_within_reach() -> None:
    here, there = seen(block(0), pose(0.0, 0.0, 0.0, 0.0)), seen(block(7), pose(0.0, 0.0, 0.0, 0.0))
    found, _ = run(hr.Pair.of(here, there), farthest=60.0)
    assert np.hypot(*found.T[:2, 3]) < 60.0 * 0.5 + 5.0


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"vertical": "wall"}, "'ground', 'sensor', 'both', got"),
        ({"voxel": 0.0}, "voxel=0.0"),
        ({"layers": (1.0,)}, "two or more"),
        ({"layers": (2.0, 1.0)}, "rising"),
        ({"farthest": -1.0}, "farthest=-1.0"),
        ({"tries": 0}, "tries=0"),
    ],
)
def test_fields_that_make_no_sense_are_refused(fields: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        hr.BirdsEye(**fields)


def test_the_stage_passes_the_public_conformance_suite() -> None:
    check_stage(hr.BirdsEye())


def test_the_preset_registers_the_courtyard(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair, truth = courtyard
    result = hr.Pipeline.preset("birdseye-gicp").run(pair)
    degrees, metres = wrong_by(result.transformation, truth)
    assert degrees < 2.0
    assert metres < 0.5
