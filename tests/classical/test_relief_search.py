# SPDX-License-Identifier: MIT
"""A bare field has a place for each pose, where its hollows are deeper than the sensors' noise."""

from __future__ import annotations

import numpy as np
import pytest
from made_fields import field_pair

import hybridreg as hr
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences
from hybridreg.testing import check_stage


def run(pair: hr.Pair, **fields: float) -> tuple[hr.Pose, hr.Scene]:
    scene = hr.VoxelGrid()(pair)
    return hr.ReliefSearch(**fields)(scene, Correspondences.none(), np.random.default_rng(0)), scene


def wrong_by(T: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    error = se3.inverse(truth) @ T
    return se3.angle_deg(error[:3, :3]), float(np.linalg.norm(T[:3, 3] - truth[:3, 3]))


@pytest.mark.parametrize("yaw", [0.0, 91.0, -160.0])
@pytest.mark.parametrize("tilt", [0.0, 12.0])
def test_a_bare_field_is_found_at_any_yaw_and_tilt(yaw: float, tilt: float) -> None:
    pair, truth = field_pair()
    start = se3.yaw(yaw) @ se3.from_rt(se3.rotation_about(np.radians([tilt, 0.0, 0.0])), np.zeros(3))
    found, _ = run(hr.Pair.of(se3.apply(start, pair.source.points), pair.target))
    degrees, metres = wrong_by(found.T @ start, truth)
    assert degrees < 1.0
    assert metres < 0.3


def test_sensors_farther_apart_than_asked_are_not_found() -> None:
    pair, truth = field_pair()
    found, _ = run(pair, farthest=5.0)
    assert np.linalg.norm(found.T[:3, 3]) < 6.0
    assert wrong_by(found.T, truth)[1] > 2.0


def test_without_ground_there_is_no_pose_but_a_note() -> None:
    rng = np.random.default_rng(0)
    ball = rng.normal(size=(5_000, 3))
    ball *= 10.0 / np.linalg.norm(ball, axis=1, keepdims=True)
    found, scene = run(hr.Pair.of(ball, ball))
    assert not found.found
    assert any("no ground" in note for note in scene.notes)


def test_it_finds_the_same_twice() -> None:
    pair, _ = field_pair()
    assert np.array_equal(run(pair)[0].T, run(pair)[0].T)


def test_it_is_a_proper_stage() -> None:
    check_stage(hr.ReliefSearch())


@pytest.mark.parametrize("fields", [{"farthest": 0.0}, {"farthest": -1.0}, {"tries": 0}])
def test_bad_fields_are_refused(fields: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="must be"):
        hr.ReliefSearch(**fields)


def test_a_pose_beside_the_right_one_is_moved_back_along_bare_ground() -> None:
    pair, truth = field_pair()
    beside = se3.from_rt(np.eye(3), np.array([0.5, -0.3, 0.0])) @ truth
    laid = hr.Pair.of(se3.apply(beside, pair.source.points), pair.target)
    stage = hr.Candidates(of=({"estimate": "identity"},), refine="none")
    found = stage(hr.VoxelGrid()(laid), Correspondences.none(), np.random.default_rng(0))
    degrees, metres = wrong_by(found.T @ beside, truth)
    assert degrees < 0.7
    assert metres < 0.25


def test_the_default_recipe_finds_a_bare_field_and_is_sure_of_it() -> None:
    pair, truth = field_pair()
    result = hr.register(pair.source, pair.target)
    degrees, metres = wrong_by(result.transformation, truth)
    assert degrees < 0.7
    assert metres < 0.3
    assert result.verdict == "ok"
    assert result.evidence["relief_correlation"] > 0.6


def test_the_default_recipe_is_not_sure_of_a_plane() -> None:
    pair, _ = field_pair(bumps=0.0)
    assert hr.register(pair.source, pair.target).verdict != "ok"
