# SPDX-License-Identifier: MIT
"""Clouds of some hundred points: chance says a good deal, and a right pose is inexact."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from made_places import Made

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.hard import is_right, sample
from hybridreg.evidence.covariance import of_information
from hybridreg.evidence.evidence import Evidence
from hybridreg.matches import Correspondences, Pose
from hybridreg.pair import Pair
from hybridreg.resolution import Tolerance
from hybridreg.verdict import judge, weigh
from hybridreg.verdict.boosted import Boosted
from hybridreg.verdict.confidence import SPARSE, confidence, features
from hybridreg.verdict.training.boosting import continued

NONE = Correspondences.none()


@pytest.mark.parametrize(
    "seed, word",
    [
        (406, "ok"),
        (410, "ok"),
        (438, "doubtful"),
        (414, "doubtful"),
        (472, "doubtful"),
        (428, "doubtful"),
    ],
)
def test_right_poses_of_few_points_are_not_failed(seed: int, word: str) -> None:
    made = sample("few", seed)
    result = hr.register(made.source, made.target)
    assert is_right(made, result.transformation)
    assert result.verdict == word
    assert any("few points" in reason for reason in result.reasons)


@pytest.mark.parametrize("seed", [416, 424, 432, 434, 446])
def test_wrong_poses_of_few_points_are_failed(seed: int) -> None:
    made = sample("few", seed)
    result = hr.register(made.source, made.target)
    assert not is_right(made, result.transformation)
    assert result.verdict == "failed"


def thinned(made: Made, n: int) -> Pair:
    rng = np.random.default_rng(0)
    source, target = (cloud.points for cloud in (made.scene.pair.source, made.scene.pair.target))
    return Pair.of(source[rng.permutation(len(source))[:n]], target[rng.permutation(len(target))[:n]])


def test_a_handful_that_agrees_is_no_certainty(crossing: Made) -> None:
    evidence = weigh(crossing.scene, Pose(crossing.truth)).evidence
    assert confidence(evidence) >= 0.95
    assert confidence(replace(evidence, compared=SPARSE - 1.0, agreed_rare=5.0)) <= 0.9


def test_a_pose_that_is_held_too_loosely_is_not_ok_and_by_how_much_is_told(crossing: Made) -> None:
    scene = VoxelGrid()(thinned(crossing, 120))
    judgement = judge(scene, Pose(crossing.truth), NONE)
    assert judgement.verdict != "ok"
    assert any("too loosely" in reason for reason in judgement.reasons)
    dense = judge(crossing.scene, Pose(crossing.truth), NONE)
    assert not any("too loosely" in reason for reason in dense.reasons)


def test_the_covariance_shrinks_with_the_scene() -> None:
    information = np.diag([40.0, 60.0, 90.0, 300.0, 200.0, 100.0])
    outdoors, small = of_information(information), of_information(information, Tolerance(2.0, 0.05))
    np.testing.assert_allclose(small[3:, 3:], 0.01 * outdoors[3:, 3:])
    np.testing.assert_allclose(small[:3, :3], 0.01 * outdoors[:3, :3], rtol=0.05)


def test_trees_for_sparse_clouds_change_nothing_elsewhere() -> None:
    stored = json.loads(files("hybridreg.verdict").joinpath("confidence.json").read_text())
    rng = np.random.default_rng(0)
    sparse = [_made(rng, 300.0) for _ in range(60)]
    right = rng.random(60) < 0.5
    more = Boosted.read(continued(stored, sparse, right, np.ones(60), below=("compared", 1000.0)))
    before = Boosted.read(stored)
    assert any(more(told) != before(told) for told in sparse)
    for _ in range(20):
        dense = _made(rng, 2500.0)
        assert more(dense) == pytest.approx(before(dense), abs=1e-9)


def _made(rng: np.random.Generator, compared: float) -> dict[str, float]:
    names = Evidence.__dataclass_fields__
    return features(Evidence(**{name: float(rng.random()) for name in names} | {"compared": compared}))
