# SPDX-License-Identifier: MIT
"""What stands beside points in an archive, a dictionary or a table and changes them: a scale, an offset, a mask."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault
from hybridreg.io.meaning.first_column import FEWEST

Array = NDArray[np.float64]

_OF = r"(?:(?:xyz|points?|coords?|coordinates?|global|add)_)?"
_TO = r"(?:_(?:xyz|factors?|points?|mask))?"
_SCALE = re.compile(rf"{_OF}scal(?:e|es|ing){_TO}|quantization")
# Of whole numbers alone: those of cells.
_CELL = re.compile(r"(?:voxel|cell|grid)_?size|resolution|lsb")
_OFFSET = re.compile(rf"{_OF}(?:offsets?|shift){_TO}")
_VALID = re.compile(rf"(?:is_?)?valid{_TO}")
# LAS calls points that were deleted withheld: PDAL's `Withheld`, lazpy's `withheld_flag`.
_INVALID = re.compile(rf"(?:is_?)?invalid{_TO}|withheld(?:_?flag)?")
_MASK = re.compile(rf"{_OF}mask")
_NO_POINTS = re.compile(
    r"(?:.*_)?(?:colou?rs?|rgba?|normals?|faces?|triangles?|edges?|ind(?:ex|ices)|labels?|feat(?:ure)?s?|desc(?:riptor)?s?|"
    r"fpfh|flow|velocit(?:y|ies)|cov(?:ariance)?s?|quat(?:ernion)?s?|rotations?|angles?|poses?|transforms?|extrinsics?|"
    r"traj(?:ectory)?|spherical|polar|uvs?|scal(?:e|es|ing)|weights?|probabilit(?:y|ies)|logits|box(?:es)?|bbox(?:es)?)"
)  # fmt: skip


def changes_points(key: Any) -> bool:
    """Whether what is called so may change the points beside it."""
    kinds = (_SCALE, _CELL, _OFFSET, _VALID, _INVALID, _MASK)
    return any(kind.fullmatch(str(key).lower()) for kind in kinds)


def is_no_points(key: str) -> bool:
    """Whether an array of that name holds something else than points: colours, normals, faces."""
    return _NO_POINTS.fullmatch(key.lower()) is not None


def with_what_is_beside(points: Array, beside: Mapping[str, Any], name: str) -> Array:
    """The points (N, 3) that an entry `valid` leaves; what else may change them is told.

    Raises
    ------
    ValueError
        They are whole numbers and a scale stands beside them: they are still to be multiplied.
    """
    held = {key: value for key, value in beside.items() if changes_points(key)}
    if not held or not len(points):
        return points
    if not _tell_scale(points, held, name):
        _tell_offset(points, held, name)
    return _valid(points, held, name)


def refuse_second_cloud(points: Array, others: Iterable[tuple[str, NDArray[Any]]], name: str) -> None:
    """Refuse an archive whose arrays have no names and of which one more than the first is a cloud.

    Raises
    ------
    ValueError
        Another array of floating numbers has the shape of a cloud, and no normals or colours of the first.
    """
    for key, other in others:
        if other.dtype.kind != "f" or other.ndim != 2 or not 3 <= other.shape[1] <= 6 or len(other) < FEWEST:
            continue
        if len(other) == len(points) and _is_attribute(other):
            continue
        problem = f"holds two clouds, arr_0 {points.shape} and {key} {other.shape}"
        raise fault(name, problem, "give one of them, saved alone or as the array 'xyz'")


def _is_attribute(other: NDArray[Any]) -> bool:
    with np.errstate(over="ignore", invalid="ignore"):
        unit = np.abs(np.linalg.norm(other[:, :3].astype(np.float64), axis=1) - 1.0) < 1e-2
        whole = bool((other == np.round(other)).all()) and other.max() <= 255.0
    return bool(unit.mean() > 0.9 or (other.min() >= 0.0 and (other.max() <= 1.0 or whole)))


def _tell_scale(points: Array, held: Mapping[str, Any], name: str) -> bool:
    whole = bool((points == np.round(points))[np.isfinite(points)].all())
    for key, value in held.items():
        lowered = key.lower()
        if not (_SCALE.fullmatch(lowered) or (whole and _CELL.fullmatch(lowered))):
            continue
        factors = _one_or_three(value)
        if factors is None or np.isin(factors, (0.0, 1.0)).all():
            continue
        told = _told(factors)
        if whole:
            problem = f"its points are whole numbers, and {key!r} beside them is {told}"
            offset = next((each for each in held if _OFFSET.fullmatch(each.lower())), None)
            then = "" if offset is None else f", add {offset!r} where that is to come after it,"
            cure = f"multiply them by it{then} and give the result; if they are metres already, leave {key!r} out"
            raise fault(name, problem, cure)
        _warn(name, f"{key!r} beside its points is {told}, which was not applied", "multiplied by that")
        return True
    return False


def _tell_offset(points: Array, held: Mapping[str, Any], name: str) -> None:
    for key, value in held.items():
        shift = _one_or_three(value) if _OFFSET.fullmatch(key.lower()) else None
        # Where the clouds of a batch end is called so too: the last at the number of points.
        if shift is not None and len(shift) == 3 and shift.any() and shift[-1] != len(points):
            _warn(
                name, f"{key!r} beside its points is {_told(shift)}, which was not applied", "shifted by that"
            )
            return


def _valid(points: Array, held: Mapping[str, Any], name: str) -> Array:
    for key, value in held.items():
        lowered = key.lower()
        flags = _flags(value, len(points))
        if flags is None or flags.all() or not (_VALID.fullmatch(lowered) or flags.any()):
            continue
        if _MASK.fullmatch(lowered):
            warnings.warn(
                f"{name}: {key!r} beside its points is true for {int(flags.sum())} of {len(flags)}, and was not "
                "applied; if it says which are points, give those alone",
                UserWarning,
                stacklevel=4,
            )
        elif _VALID.fullmatch(lowered) or _INVALID.fullmatch(lowered):
            good = flags if _VALID.fullmatch(lowered) else ~flags
            warnings.warn(
                f"{name}: {int((~good).sum())} of {len(good)} points are not valid by {key!r} beside them; they were "
                "left out",
                UserWarning,
                stacklevel=4,
            )
            return points[good]
    return points


def _warn(name: str, problem: str, done: str) -> None:
    text = f"{name}: {problem}; if its coordinates are to be {done}, do so and give the result"
    warnings.warn(text, UserWarning, stacklevel=5)


def _told(numbers: Array) -> str:
    return ", ".join(f"{each:g}" for each in numbers)


def _array(value: Any) -> NDArray[Any] | None:
    if isinstance(value, (str, bytes)) or callable(value):
        return None
    try:
        array = np.asarray(value.detach().cpu() if hasattr(value, "detach") else value)
    except Exception:  # what is no array says nothing; a third-party object may raise anything
        return None
    return np.ravel(array) if array.dtype.kind in "fiub" else None


def _one_or_three(value: Any) -> Array | None:
    array = _array(value)
    if array is None or array.size not in (1, 3) or array.dtype.kind == "b":
        return None
    numbers = np.asarray(array, dtype=np.float64)
    return numbers if np.isfinite(numbers).all() else None


def _flags(value: Any, count: int) -> NDArray[np.bool_] | None:
    array = _array(value)
    if array is None or array.size != count or not np.isin(array, (0, 1)).all():
        return None
    return array.astype(bool)
