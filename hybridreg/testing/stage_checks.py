# SPDX-License-Identifier: MIT
"""The contract of a stage, as checks."""

from __future__ import annotations

import copy
import inspect
import pickle
import random
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.scene import Level, Scene
from hybridreg.slots import SLOTS
from hybridreg.testing.small_inputs import sample_scene, true_matches
from hybridreg.testing.stage_outputs import error_m, same, valid

Array = NDArray[np.float64]
Check = Callable[[Any, str], None]
# Metres that a refinement may end farther from the true pose than twice its start.
_ASIDE = 0.5


def checks() -> list[Check]:
    """The individual checks, for `pytest.mark.parametrize`."""
    return [
        check_parameters,
        check_seed,
        check_pickle_and_clone,
        check_output,
        check_permuted_points,
        check_near_truth,
        check_rigid_motion,
        check_no_overlap,
        check_no_matches,
        check_one_match,
    ]


def check_stage(stage: Any, slot: str | None = None) -> None:
    """Run every check that applies to a stage's slot.

    Parameters
    ----------
    stage : the stage
    slot : "downsample", "overlap", "match", "estimate" or "refine"; may be left out for a registered stage

    Raises
    ------
    AssertionError
        Naming the check that failed.
    """
    slot = slot or slot_of(stage)
    for check in checks():
        try:
            check(stage, slot)
        except AssertionError as error:
            raise AssertionError(f"{type(stage).__name__} fails {check.__name__}: {error}") from error
        except Exception as error:
            message = f"{type(stage).__name__} fails {check.__name__}: raised {error!r}"
            raise AssertionError(message) from error


def slot_of(stage: Any) -> str:
    """Slot of a registered stage."""
    from hybridreg.registry import name_of

    registered = name_of(stage)
    if registered is None:
        raise ValueError(
            f"{type(stage).__name__} is not registered; say which slot it fills: {', '.join(SLOTS)}"
        )
    return registered.partition(".")[0]


def check_parameters(stage: Any, slot: str) -> None:
    """A misspelled keyword is refused at once."""
    assert slot in SLOTS, f"{slot!r} is not a slot; the slots are {', '.join(SLOTS)}"
    try:
        type(stage)(this_is_no_parameter=1)
    except TypeError:
        return
    raise AssertionError("a keyword that does not exist was accepted")


def check_pickle_and_clone(stage: Any, slot: str) -> None:
    """Survives pickling and copying, unchanged."""
    for other in (pickle.loads(pickle.dumps(stage)), copy.deepcopy(stage)):
        same(_run(stage, slot), _run(other, slot))
    if hasattr(stage, "get_params"):
        params = stage.get_params(deep=False)
        clone = type(stage)(**params)
        assert all(clone.get_params(deep=False)[k] is v for k, v in params.items()), (
            "parameters are not kept as given"
        )


def check_output(stage: Any, slot: str) -> None:
    """Returns the slot's type, with the promised shapes; leaves its inputs unchanged."""
    scene, truth = sample_scene()
    matches, pose = true_matches(scene, truth), Pose(truth @ se3.yaw(1.0))
    given = {
        "the source's points": scene.source.points,
        "the target's points": scene.target.points,
        "the matches": np.hstack([matches.source, matches.target, matches.weight[:, None]]),
        "the pose": pose.T,
    }
    before = {name: array.copy() for name, array in given.items()}
    out = _run(stage, slot, scene, matches, pose)
    called = slot != "match" or _takes_overlap(stage)
    valid(out, slot, scene, promised=getattr(stage, "gives", ()) if called else ())
    given["the matches"] = np.hstack([matches.source, matches.target, matches.weight[:, None]])
    for name, array in given.items():
        assert np.array_equal(before[name], array), f"{name} changed in place"


def check_seed(stage: Any, slot: str) -> None:
    """The same generator gives the same bits, and nothing else is random."""
    states = _global_states()
    same(_run(stage, slot), _run(stage, slot))
    for name, state in _global_states().items():
        assert states.get(name, state) == state, f"the global generator of {name} was used"


def _global_states() -> dict[str, bytes]:
    states = {"random": repr(random.getstate()).encode(), "numpy": np.random.get_state()[1].tobytes()}  # type: ignore[index]
    if "torch" in sys.modules:
        states["torch"] = sys.modules["torch"].get_rng_state().numpy().tobytes()
    return states


def check_permuted_points(stage: Any, slot: str) -> None:
    """The order of either cloud's points does not matter except for random sampling."""
    scene, _ = sample_scene()
    orders = [
        np.random.default_rng(seed).permutation(len(level))
        for seed, level in ((1, scene.source), (2, scene.target))
    ]
    source, target = (
        Level(points=level.points[order], spacing=level.spacing, viewpoint=level.viewpoint)
        for level, order in zip((scene.source, scene.target), orders, strict=True)
    )
    other = Scene(pair=scene.pair, source=source, target=target)
    one, two = _run(stage, slot, scene), _run(stage, slot, other)
    if slot == "overlap":
        for side, order in zip(("source", "target"), orders, strict=True):
            same = np.allclose(getattr(one, side)[order], getattr(two, side), atol=1e-6)
            assert same, f"the {side}'s overlap depends on the order"
    if slot == "match":
        assert abs(len(one) - len(two)) <= 0.2 * max(len(one), 20), (
            "the number of matches depends on the order"
        )
    if slot in ("estimate", "refine"):
        error = error_m(one.T, two.T, scene)
        assert error < 0.5 or not (one.found and two.found), (
            f"the pose moves by {error:.2f} m with the order of points"
        )


def check_near_truth(stage: Any, slot: str) -> None:
    """A refinement that begins a degree beside the true pose does not lead away from it."""
    if slot == "refine":
        scene, truth = sample_scene()
        start = truth @ se3.yaw(1.0)
        out = stage(scene, Pose(start.copy()))
        assert out.found, "loses a pose that is nearly right"
        begun, ended = error_m(start, truth, scene), error_m(out.T, truth, scene)
        assert ended < 2.0 * begun + _ASIDE, f"leads from {begun:.2f} m beside the true pose to {ended:.2f} m"


def check_rigid_motion(stage: Any, slot: str) -> None:
    """Rotating the source rotates the pose accordingly; an estimator that ignores the clouds is exempt."""
    if slot != "estimate" or not getattr(stage, "needs", frozenset()) & {"matches", "group"}:
        return
    scene, truth = sample_scene()
    motion = se3.from_rt(se3.rotation_about(np.array([0.0, 0.0, 1.0])), np.array([3.0, -2.0, 0.5]))
    matches = true_matches(scene, truth)
    moved = Correspondences(
        source=se3.apply(motion, matches.source),
        target=matches.target,
        weight=matches.weight,
        group=matches.group,
    )
    level = Level(points=se3.apply(motion, scene.source.points), spacing=scene.source.spacing)
    one = stage(scene, matches, np.random.default_rng(0))
    two = stage(Scene(pair=scene.pair, source=level, target=scene.target), moved, np.random.default_rng(0))
    error = error_m(one.T, two.T @ motion, scene)
    assert error < 0.1, f"turning the source changes the aligned cloud by {error:.2f} m"


def check_no_overlap(stage: Any, slot: str) -> None:
    """A matcher survives an overlap of zero everywhere."""
    if slot == "match" and _takes_overlap(stage):
        scene, _ = sample_scene()
        out = stage(scene, Overlap(np.zeros(len(scene.source)), np.zeros(len(scene.target))))
        valid(out, slot, scene)


def check_no_matches(stage: Any, slot: str) -> None:
    """An estimator survives having nothing to work with, and says so."""
    if slot == "estimate":
        scene, _ = sample_scene()
        out = stage(scene, Correspondences.none(), np.random.default_rng(0))
        valid(out, slot, scene)
        if getattr(stage, "needs", frozenset()):
            assert not out.found, "claims to have found a pose from no matches"


def check_one_match(stage: Any, slot: str) -> None:
    """One match determines no pose; the estimator must not crash on it."""
    if slot == "estimate":
        scene, truth = sample_scene()
        one = true_matches(scene, truth, n=1)
        valid(stage(scene, one, np.random.default_rng(0)), slot, scene)


def _run(
    stage: Any,
    slot: str,
    scene: Scene | None = None,
    matches: Correspondences | None = None,
    pose: Pose | None = None,
) -> Any:
    made, truth = sample_scene()
    scene = scene or made
    if slot == "downsample":
        return stage(scene.pair)
    if slot == "overlap":
        return stage(scene)
    if slot == "match":
        if not _takes_overlap(stage):
            return Correspondences.none()
        return stage(scene, Overlap.full(len(scene.source), len(scene.target)))
    if slot == "estimate":
        return stage(
            scene, true_matches(made, truth) if matches is None else matches, np.random.default_rng(7)
        )
    return stage(scene, pose or Pose(truth @ se3.yaw(1.0)))


def _takes_overlap(stage: Any) -> bool:
    # The placeholder for the caller's own matches refuses to be called; every other matcher is called.
    from hybridreg.classical.nothing import GivenMatches

    return not isinstance(stage, GivenMatches) and bool(inspect.signature(stage).parameters)
