# SPDX-License-Identifier: MIT
"""The conformance suite passes our stages and catches broken ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from hybridreg import registry, testing
from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.scene import Scene
from hybridreg.stage import Stage


def built_in() -> list[str]:
    return [
        key for key in sorted(registry.BUILT_IN) if not registry.BUILT_IN[key].startswith("hybridreg.learned")
    ]


@pytest.mark.parametrize("key", built_in())
def test_our_stages_pass(key: str) -> None:
    testing.check_stage(registry.load(*key.split(".", 1))())


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


def test_a_careful_one_passes() -> None:
    testing.check_stage(Careless(), "match")


@pytest.mark.parametrize(
    "fault, words",
    [
        ("global random", "check_pickle_and_clone|check_seed"),
        ("own random", "check_pickle_and_clone|check_seed"),
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
