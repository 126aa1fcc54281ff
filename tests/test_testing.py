# SPDX-License-Identifier: MIT
"""The conformance suite passes our stages and catches broken ones."""

from __future__ import annotations

import random
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from hybridreg import registry, testing
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.pair import Pair
from hybridreg.scene import Level, Scene
from hybridreg.stage import Stage
from hybridreg.testing import stage_checks


def built_in() -> list[str]:
    return [
        key for key in sorted(registry.BUILT_IN) if not registry.BUILT_IN[key].startswith("hybridreg.learned")
    ]


# What a stage does 50,000 times is seen in fewer.
FEWER = {"estimate.ransac-50k": {"iterations": 5_000}}


@pytest.mark.parametrize("key", built_in())
def test_our_stages_pass(key: str) -> None:
    testing.check_stage(registry.load(*key.split(".", 1))(**FEWER.get(key, {})))


@dataclass(frozen=True, kw_only=True)
class Careless(Stage):
    """A matcher with one fault at a time."""

    fault: str = ""

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        if self.fault == "global random":
            rows = np.random.randint(0, len(scene.source), 10)
        elif self.fault == "own random":
            rows = np.random.default_rng().integers(0, len(scene.source), 10)
        elif self.fault == "needs overlap":
            rows = np.flatnonzero(overlap.source > 0.5)[[0, 1, 2]]
        else:
            rows = np.arange(10)
        if self.fault == "in place":
            scene.source.points.setflags(write=True)
            scene.source.points[0] += 1.0
        target = scene.target.points[rows % len(scene.target)]
        weight = np.full(len(rows), -1.0 if self.fault == "negative" else 1.0)
        if self.fault == "wrong type":
            return (scene.source.points[rows], target)  # type: ignore[return-value]
        return Correspondences(source=scene.source.points[rows], target=target, weight=weight)


@dataclass(frozen=True, kw_only=True)
class Swapping(Stage):
    """Hands on another pair than the one that it was given."""

    def __call__(self, pair: Pair) -> Scene:
        return Scene.on_cells(pair.with_clouds(pair.target, pair.source), 0.5)


def test_a_downsample_stage_must_hand_on_the_pair() -> None:
    with pytest.raises(AssertionError, match="source: the pair of the scene is another one"):
        testing.check_stage(Swapping(), "downsample")


def test_a_careful_one_passes() -> None:
    testing.check_stage(Careless(), "match")


@pytest.mark.parametrize(
    "fault, words",
    [
        ("global random", "check_seed"),
        ("own random", "check_seed"),
        ("needs overlap", "check_no_overlap: raised IndexError"),
        ("in place", "changed in place|differ"),
        ("negative", "negative"),
        ("wrong type", "not Correspondences|has no attribute"),
    ],
)
def test_each_fault_is_named(fault: str, words: str) -> None:
    with pytest.raises(AssertionError, match=words):
        testing.check_stage(Careless(fault=fault), "match")


def test_an_estimator_that_claims_too_much_is_caught() -> None:
    class Boaster:
        needs = frozenset({"matches"})

        def __call__(self, scene: Scene, matches: Correspondences, rng: Any) -> Pose:
            return Pose(np.eye(4))

    with pytest.raises(AssertionError, match=r"check_parameters|check_pickle|claims to have found"):
        testing.check_stage(Boaster(), "estimate")


def test_an_unregistered_stage_must_name_its_slot() -> None:
    with pytest.raises(ValueError, match="which slot"):
        testing.check_stage(Careless())
    with pytest.raises(AssertionError, match="is not a slot"):
        testing.check_stage(Careless(), "matching")


def test_the_sample_pair_has_the_pose_it_claims() -> None:
    scene, truth = testing.sample_scene()
    from hybridreg.geometry.fitness import measure

    on, off = (measure(scene.source.points, scene.target.points, T, 0.4).fitness for T in (truth, np.eye(4)))
    assert on > 0.7
    assert off < on - 0.1, "a pose that nothing tells from the identity tests nothing"


def _refine(change: Any) -> Any:
    @dataclass(frozen=True, kw_only=True)
    class Refiner:
        def __call__(self, scene: Scene, pose: Pose) -> Pose:
            return change(pose)

    return Refiner()


def _moved_in_place(pose: Pose) -> Pose:
    pose.T[0, 3] += 0.1
    return Pose(pose.T.copy())


@pytest.mark.parametrize(
    ("change", "check", "words"),
    [
        (_moved_in_place, stage_checks.check_output, "the pose changed in place"),
        (lambda pose: Pose(se3.inverse(pose.T)), stage_checks.check_near_truth, "leads from"),
        (lambda pose: Pose.unknown(), stage_checks.check_near_truth, "loses a pose"),
    ],
)
def test_a_refinement_that_leads_away_is_caught(change: Any, check: Any, words: str) -> None:
    with pytest.raises(AssertionError, match=words):
        check(_refine(change), "refine")


@dataclass(frozen=True, kw_only=True)
class Swapped:
    """A matcher that confuses the clouds, or promises what it does not give."""

    fault: str
    gives = frozenset({"matches", "group"})

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        source, target = scene.source.points[:20], scene.target.points[:20]
        if self.fault == "swapped":
            source, target = target + [40.0, 0.0, 0.0], source
        if self.fault == "random":
            random.random()
        group = None if self.fault == "no group" else np.zeros(20, dtype=np.int64)
        return Correspondences(source=source, target=target, weight=np.ones(20), group=group)


@pytest.mark.parametrize(
    ("fault", "check", "words"),
    [
        ("no group", stage_checks.check_output, "promises groups and gives none"),
        ("swapped", stage_checks.check_output, "are the clouds swapped"),
        ("random", stage_checks.check_seed, "the global generator of random was used"),
    ],
)
def test_a_matcher_that_breaks_its_word_is_caught(fault: str, check: Any, words: str) -> None:
    with pytest.raises(AssertionError, match=words):
        check(Swapped(fault=fault), "match")
    check(Swapped(fault=""), "match")


def test_an_overlap_that_depends_on_the_targets_order_is_caught() -> None:
    def first_half(scene: Scene) -> Overlap:
        n = len(scene.target)
        return Overlap(np.ones(len(scene.source)), (np.arange(n) < n // 2).astype(float))

    with pytest.raises(AssertionError, match="the target's overlap depends on the order"):
        stage_checks.check_permuted_points(first_half, "overlap")


def test_a_downsampling_that_leaves_no_target_is_caught() -> None:
    def empty(pair: Pair) -> Scene:
        whole = Scene.on_cells(pair, 0.5)
        return replace(whole, target=Level(points=np.zeros((0, 3)), spacing=0.5))

    with pytest.raises(AssertionError, match="target: no point is left"):
        stage_checks.check_output(empty, "downsample")
