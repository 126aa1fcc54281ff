# SPDX-License-Identifier: MIT
"""Do the stages of a pipeline fit together, and does the pair fit them?"""

from __future__ import annotations

import dataclasses
import functools
import os
import types
import warnings
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hybridreg import gate, registry
from hybridreg.geometry import units
from hybridreg.geometry.extent import lone, share_within
from hybridreg.pair import Pair
from hybridreg.scene import SIDES, Scene, Side
from hybridreg.slots import SLOTS

if TYPE_CHECKING:
    from hybridreg.pipeline import Pipeline

_FARTHEST = 2_000.0  # metres: no LiDAR reaches farther
_SMALLEST = 0.05  # metres: no sensor pair shares a smaller scene
# Cells along one axis beyond which the voxel or the unit is wrong: 1 cm cells over 1 km.
_MANY_CELLS = 100_000
# Below this the grid has merged the points that were to be matched.
_FEW_LEFT = 200
# `dataclasses.replace` hands both on, though its caller gave one.
_ONE_OF_THEM = "leave one of them out, or change a pipeline by its own method replace"
_FUNCTIONS = (types.FunctionType, types.MethodType, types.BuiltinFunctionType, functools.partial)


def with_voxel(downsample: Any, voxel: float | None) -> Any:
    """The downsampling stage with the voxel of `Pipeline(voxel=...)`."""
    if voxel is None:
        return downsample
    if isinstance(voxel, bool) or not isinstance(voxel, Real):
        raise ValueError(f"voxel={voxel!r} must be a positive length in metres")
    if not _takes_voxel(downsample):
        raise ValueError(
            f"voxel={voxel} was given, but {type(downsample).__name__} has no voxel; {_ONE_OF_THEM}"
        )
    if downsample.voxel == voxel:
        return downsample
    if downsample.voxel is not None:
        raise ValueError(
            f"voxel={voxel} contradicts the downsampling stage's own voxel={downsample.voxel}; {_ONE_OF_THEM}"
        )
    return dataclasses.replace(downsample, voxel=voxel)


def without_voxel(downsample: Any) -> Any:
    """The downsampling stage with a voxel that it derives; as it is where it has none of its own."""
    own = _takes_voxel(downsample) and downsample.voxel is not None
    return dataclasses.replace(downsample, voxel=None) if own else downsample


def ready_for_voxel(downsample: Any, voxel: float | None) -> Any:
    """The downsampling stage to which a pipeline's voxel is given anew: a grid, if this one takes none."""
    return without_voxel(downsample) if voxel is None or _takes_voxel(downsample) else "voxel"


def _takes_voxel(downsample: Any) -> bool:
    return dataclasses.is_dataclass(downsample) and hasattr(downsample, "voxel")


def following(before: Any, after: Any, estimate: Any) -> Any:
    """The estimate stage with the weights of a match stage that takes another's place.

    `Lgr` takes its numbers from the configuration of the network whose matches it gets. Where it named the same weights
    as the match stage before, it names those of the match stage after, too; none where these are a published
    checkpoint, a file without such a configuration, for which its own defaults are meant.
    """
    named, now = getattr(before, "weights", None), getattr(after, "weights", None)
    own = getattr(estimate, "weights", None)
    if own is None or own != named or now == named or not hasattr(after, "weights"):
        return estimate
    return dataclasses.replace(estimate, weights=None if now is None or os.path.isfile(now) else now)


def check(pipeline: Pipeline) -> None:
    """Refuse stages that do not fit.

    Raises
    ------
    ValueError
        Naming the slot, what is missing, and stages that would fit.
    """
    for slot in SLOTS:
        check_stage(slot, getattr(pipeline, slot))
    check_match(pipeline.match, pipeline.estimate)
    masks = registry.name_of(pipeline.overlap) not in (None, "overlap.none")
    if masks and registry.name_of(pipeline.match) == "match.none":
        raise ValueError(
            f"overlap: nothing looks at the mask of {_label(pipeline.overlap)} where match is 'none'; leave overlap at "
            "'none', or choose a matcher"
        )


def check_stage(where: str, stage: Any) -> None:
    """Refuse what cannot be called, and a class in the place of its object."""
    if isinstance(stage, type):
        raise ValueError(
            f"{where}: {stage.__name__} is a class; give an object of it, such as {stage.__name__}()"
        )
    if not callable(stage):
        raise ValueError(f"{where}: {stage!r} is not a stage; it must be callable")


def check_match(match: Any, estimate: Any) -> None:
    """Refuse an estimator that needs what the matcher does not give; one that does not tell is trusted."""
    if not hasattr(match, "gives"):
        return
    given = _words(match, "gives")
    lacking = _words(estimate, "needs") - given - {"image"}
    if not lacking:
        return
    word = sorted(lacking)[0]
    raise ValueError(
        f"{_label(estimate)} needs {word!r} from the match stage, and {_label(match)} does not give "
        f"it. Matchers that do: {_or(registry.slot_fits('match', gives=word))}. Estimators that work with "
        f"{_label(match)}: {_or(registry.slot_fits('estimate', needs=given))}"
    )


def check_seed(seed: int) -> None:
    """Refuse values that numpy's generators do not take as a seed."""
    if isinstance(seed, bool) or not isinstance(seed, Integral) or seed < 0:
        raise ValueError(f"seed={seed!r} must be a whole number, 0 or more")


def check_image(pipeline: Pipeline, pair: Pair) -> None:
    """Refuse what is no pair, and a pair without an image where a stage needs one."""
    if not isinstance(pair, Pair):
        cure = "give its pair" if hasattr(pair, "pair") else "hybridreg.Pair.of(source, target) makes one"
        raise TypeError(f"pair: expected a Pair, got {type(pair).__name__}; {cure}")
    for slot in SLOTS:
        check_stage_image(getattr(pipeline, slot), pair)


def check_stage_image(stage: Any, pair: Pair) -> None:
    """Refuse a pair without an image where this stage needs one."""
    if not pair.has_image and "image" in _words(stage, "needs"):
        raise ValueError(f"pair {pair.id}: {_label(stage)} needs an image; pass image=...")


def changed(scene: Scene, given: Pair) -> Side | None:
    """Which cloud of the scene's pair is another one than was given, if any; it may hold fewer points, or means of
    several, and walls that were drawn into it.

    What is judged is that pair: a pose for clouds that a stage has moved is none for those of the user.
    """
    if scene.pair.drawn:
        return None
    for name in SIDES:
        own, its, reach = getattr(given, name), getattr(scene.pair, name), scene.level(name).spacing
        if its is own or np.array_equal(its.points, own.points):
            continue
        rows = {
            *its.points.argmin(axis=0),
            *its.points.argmax(axis=0),
            *range(0, len(its), len(its) // 6 + 1),
        }
        same_frame = np.array_equal(its.offset, own.offset)
        if not (same_frame and all(_has(own.points, its.points[row], reach) for row in rows)):
            return name
    return None


def _has(points: NDArray[np.float64], place: NDArray[np.float64], reach: float) -> bool:
    # Whether one of many points lies near a place, within some metres along each axis.
    beside = points[np.abs(points[:, 0] - place[0]) <= reach]
    return bool((np.abs(beside - place) <= reach).all(axis=1).any())


def check_scene(scene: Scene, given: Pair) -> None:
    """Refuse levels that are too small to register; warn of a unit or a voxel that is obviously wrong. `given` is the
    pair before anything was drawn into it: walls hide that its numbers are whole, or degrees."""
    other = changed(scene, given)
    if other:
        raise ValueError(
            f"downsample: the stage gave back a scene with another {other} than the one that it was given; change "
            "the levels, not the pair: Scene.on_cells(pair, voxel)"
        )
    doubts = units.doubts(given if scene.pair.drawn else scene.pair)
    for name, text in doubts.items():
        _warn(f"{name}: {text}")
    _check_flat(given)
    for name, cloud, level in (
        ("source", scene.pair.source, scene.source),
        ("target", scene.pair.target, scene.target),
    ):
        if len(level) < gate.MIN_POINTS:
            raise ValueError(
                f"{name}: {len(level)} of {len(cloud)} points are left after downsampling to {level.spacing:.3g} m, "
                f"fewer than {gate.MIN_POINTS}; choose a smaller voxel"
            )
        if doubts:  # one sentence names the cloud at fault
            continue
        low, high = cloud.bounds
        extent = high - low
        axis = int(np.argmax(extent))
        cells = extent[axis] / level.spacing
        if cells > _MANY_CELLS:
            far = lone(cloud.points)
            _warn(
                f"{name}: {cells:.3g} voxels of {level.spacing:.3g} m along {'xyz'[axis]}; "
                + (f"{far}, remove them" if far else "are the coordinates in metres?")
            )
        elif len(level) < min(_FEW_LEFT, 0.5 * len(cloud)):
            _warn(
                f"{name}: only {len(level)} of {len(cloud)} points are left after downsampling to "
                f"{level.spacing:.3g} m; a smaller voxel or another unit may be meant"
            )
        # The inner half of the points, so that one stray return does not decide.
        reach = share_within(cloud.radii, 0.5)
        if reach > _FARTHEST or reach < _SMALLEST:
            unit = "millimetres" if reach > _FARTHEST else "kilometres or a normalised unit"
            _warn(
                f"{name}: half of the points lie {'beyond' if reach > _FARTHEST else 'within'} {reach:.3g} m of the "
                f"cloud's middle; lengths here are metres, are yours {unit}?"
            )


def _check_flat(pair: Pair) -> None:
    # Of a cloud and a flat scan, whose heights were lost more often than it has none.
    clouds = {"source": pair.source, "target": pair.target}
    level = {
        name: [k for k in range(3) if np.ptp([b[k] for b in cloud.bounds]) == 0.0]
        for name, cloud in clouds.items()
    }
    flat = [name for name, axes in level.items() if axes]
    if len(flat) == 1:
        name, other = flat[0], "target" if flat[0] == "source" else "source"
        axis = level[name][0]
        _warn(
            f"{name}: all its {'xyz'[axis]} are {clouds[name].bounds[0][axis]:g}, and the {other} is no flat scan; "
            f"give the column that was lost, or cut the {other} at the height of the scan"
        )


def _warn(text: str) -> None:
    warnings.warn(text, UserWarning, stacklevel=5)


def _words(stage: Any, attribute: str) -> frozenset[str]:
    return frozenset(getattr(stage, attribute, ()))


def _label(stage: Any) -> str:
    if isinstance(stage, _FUNCTIONS):
        return str(getattr(stage, "__name__", type(stage).__name__))
    registered = registry.name_of(stage)
    return f'{type(stage).__name__} ("{registered}")' if registered else type(stage).__name__


def _or(names: list[str]) -> str:
    return ", ".join(names) if names else "none that is installed"
