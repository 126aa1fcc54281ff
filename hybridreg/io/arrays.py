# SPDX-License-Identifier: MIT
"""The points in a NumPy array, in any of the layouts that drivers and development kits use."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.column_names import axes_in, stem_and_unit
from hybridreg.io.coordinate_systems.length_unit import in_metres
from hybridreg.io.faults import fault
from hybridreg.io.meaning.beside_points import with_what_is_beside
from hybridreg.io.meaning.first_column import FEWEST, check_first_column
from hybridreg.io.meaning.homogeneous import refuse_homogeneous
from hybridreg.io.meaning.image_shapes import check_photo, refuse_image
from hybridreg.io.meaning.spherical import tell_spherical
from hybridreg.io.meaning.stacked_clouds import tell_stack
from hybridreg.io.meaning.unit_words import known_metres
from hybridreg.io.record_fields import stack_axes

Array = NDArray[np.float64]

# Fields of one array that hold all three coordinates.
TOGETHER = ("xyz", "points", "point", "positions", "position", "pos", "coords", "coord", "coordinates")
# So 3 to 6 rows of at least that length are channels: x, y, z, w (or intensity), ring, time.
_MOST_CHANNELS = 6
# Sensors have eight rows or more; a stack with fewer is more likely several clouds.
_FEWEST_ROWS = 8
# What poses have, and rotations, one after another; and by how much R R^T of one may be off.
_POSES = ((4, 4), (3, 4), (3, 3))
_NO_ROTATION = 1e-3
# Of a raw LAS record: its X, Y and Z are whole numbers still to be scaled.
_LAS_ONLY = ("bit_fields", "raw_classification", "point_source_id")


def array_points(array: NDArray[Any], name: str, *, batched: bool = False, cure: str = "") -> Array:
    """x, y and z, shape (N, 3), a copy; masked values become NaN.

    Parameters
    ----------
    array : (N, 3+), (3 to 6, N), (H, W, 3+) or (3 to 6, H, W) numbers, or records with fields x, y, z (or xyz)
        Of records any order, type, padding and number of dimensions; a unit in the name counts, as `X (mm)`.
    name : str
        What error messages call the cloud.
    batched : bool
        Whether a third dimension means several clouds (torch), not rows of one.
    cure : str
        How to leave out a first column that is no x; empty for an array, which is told its slice.

    Raises
    ------
    ValueError
        Another shape or type, naming both and the cure.
    """
    if array.dtype.names:
        return _of_fields(array, name)
    if array.dtype.kind not in "fiu":
        raise fault(name, f"coordinates must be numbers, got dtype {_short(array)}", _as_numbers(array))
    rows = _rows(array, name, batched)
    tell_spherical(rows, name)
    refuse_homogeneous(rows, name, _divided(array))
    check_first_column(rows, name, cure or f"leave it out: give columns 2 to 4, {_without_first(array)}")
    return _numbers(rows[:, :3])


def _rows(array: NDArray[Any], name: str, batched: bool) -> NDArray[Any]:
    shape = array.shape
    _refuse_poses(array, name)
    if array.ndim == 3 and {shape[0], shape[2]} & {3, 4}:
        check_photo(array, name)
    if array.ndim == 2 and shape[0] in range(3, _MOST_CHANNELS + 1) and shape[1] >= FEWEST:
        return array.T
    if array.ndim == 3 and 3 <= shape[2] <= _MOST_CHANNELS and not (batched and shape[0] > 1):
        if 1 < shape[0] < _FEWEST_ROWS:
            cure = "pass one of them, x[0], or all as one cloud, x.reshape(-1, 3)"
            raise fault(
                name, f"expected an array of shape (N, 3), got {shape}: one cloud or {shape[0]}?", cure
            )
        if shape[0] > 1 and shape[1] >= FEWEST:
            tell_stack(array, name)
        return array.reshape(-1, shape[2])
    if _is_channels(shape) and not batched:
        return array.reshape(shape[0], -1).T
    if array.ndim == 2 and shape[1] >= 3:
        if shape[0] < FEWEST <= shape[1]:
            cure = (
                "if they are channels, transpose and choose: x[:3].T; a range image must be unprojected first"
            )
            raise fault(name, f"expected an array of shape (N, 3), got {shape}, {shape[0]} points", cure)
        refuse_image(shape[0], shape[1], name)
        return array
    flat = np.squeeze(array)
    if flat.ndim == 2 and min(flat.shape) > _MOST_CHANNELS:
        refuse_image(flat.shape[0], flat.shape[1], name)
    raise fault(name, f"expected an array of shape (N, 3), got {shape}", _shape_cure(array, batched))


def _is_channels(shape: tuple[int, ...]) -> bool:
    # Three rows of many points are x, y and z of several clouds, (B, 3, N), as networks take them.
    batch = len(shape) == 3 and shape[1] in range(3, _MOST_CHANNELS + 1) and shape[2] >= FEWEST
    return len(shape) == 3 and shape[0] in range(3, _MOST_CHANNELS + 1) and not batch


def _refuse_poses(array: NDArray[Any], name: str) -> None:
    # A trajectory has the shape of an organised cloud, and its rotations would be points at 1 m from the origin.
    if array.ndim != 3 or array.shape[1:] not in _POSES:
        return
    R = np.ma.getdata(array)[:, :3, :3].astype(np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(R @ np.swapaxes(R, 1, 2) - np.eye(3)).max(initial=0.0)
    if off < _NO_ROTATION:
        where = "; their positions are x[:, :3, 3]" if array.shape[2] == 4 else ""
        raise fault(
            name, f"its shape {array.shape} holds {len(array)} poses, not points", f"give a cloud{where}"
        )


def _without_first(array: NDArray[Any]) -> str:
    return "x[1:4]" if _channels_first(array) else "x[..., 1:4]"


def _divided(array: NDArray[Any]) -> str:
    return "x[:3] / x[3]" if _channels_first(array) else "x[..., :3] / x[..., 3:]"


def _channels_first(array: NDArray[Any]) -> bool:
    return array.shape[0] in range(3, _MOST_CHANNELS + 1) and array.shape[-1] > _MOST_CHANNELS


def _shape_cure(array: NDArray[Any], batched: bool) -> str:
    shape, channels = array.shape, range(3, _MOST_CHANNELS + 1)
    if array.ndim >= 4 and shape[-1] in channels:
        return f"give one cloud of the batch, a point a row: {'x' + '[0]' * (array.ndim - 3)}.reshape(-1, {shape[-1]})"
    if array.ndim == 4 and shape[1] in channels:
        return f"give one cloud of the batch, a point a row: x[0].reshape({shape[1]}, -1).T"
    if array.ndim == 3 and shape[0] in channels and shape[2] > _MOST_CHANNELS and batched:
        return f"if its {shape[0]} images are x, y and z, give a point a row: x.reshape({shape[0]}, -1).T"
    if array.ndim == 3 and shape[1] in channels and shape[2] >= FEWEST:
        other = f"; if each is one axis, x.reshape({shape[0]}, -1).T" if shape[0] in channels else ""
        return f"if they are {shape[0]} clouds, give one, a point a row: x[0].T{other}"
    if array.ndim == 3 and array.shape[2] >= 3 and batched:
        return "give one cloud of the batch, x[0]"
    if array.ndim == 1 and array.size and array.size % 3 == 0:
        return "if it holds x, y, z of one point after another: x.reshape(-1, 3)"
    if array.ndim == 2 and array.shape[1] == 2:
        return "a pose in space needs three coordinates: numpy.column_stack([x, y, z])"
    return "give one row a point: numpy.column_stack([x, y, z])"


def together_in(names: Sequence[Any]) -> tuple[int, float | None] | None:
    """Which of the names is that of all three coordinates, such as `xyz` or `points_mm`, and its unit in metres."""
    parsed = [stem_and_unit(str(each)) for each in names]
    if "x" in [stem for stem, _ in parsed]:
        return None
    for wanted in TOGETHER:
        for k, (stem, unit) in enumerate(parsed):
            metres = known_metres(unit)
            if stem == wanted and (metres is not None or not unit):
                return k, metres
    return None


def refuse_raw_las(names: Sequence[str], name: str) -> None:
    """Refuse the fields of LAS as they are stored, as laspy's `points.array` and lazpy's `arrays()` hold them.

    Raises
    ------
    ValueError
        One of the names is a field of LAS, and the coordinates are called X, Y and Z.
    """
    raw = [each for each in names if each.lower() in _LAS_ONLY]
    if raw and "X" in names:
        problem = f"is a raw LAS record (it has {raw[0]!r}), its X, Y and Z are not scaled"
        raise fault(name, problem, "give what laspy.read returns, or its xyz")


def _of_fields(array: NDArray[Any], name: str) -> Array:
    names = array.dtype.names or ()
    refuse_raw_las(names, name)
    together = together_in(names)
    if together is not None:
        k, metres = together
        points = array_points(array[names[k]].reshape(-1, *array.dtype[k].shape), name)
        return with_what_is_beside(
            in_metres(points, metres, name), {each: array[each] for each in names}, name
        )
    axes = axes_in(names, name)
    _refuse_several(array.dtype, [names[column] for column in axes.columns], name)
    columns = [np.ravel(array[names[column]]) for column in axes.columns]
    if any(column.dtype.kind not in "fiu" or len(column) != array.size for column in columns):
        raise fault(name, f"its x, y and z are {_short(array)}, not one number each", _as_numbers(columns[0]))
    points = in_metres(stack_axes(*(_numbers(column) for column in columns)), axes.metres, name)
    return with_what_is_beside(points, {each: array[each] for each in names}, name)


def _refuse_several(dtype: np.dtype[Any], axes: list[str], name: str) -> None:
    shapes = [dtype[axis].shape for axis in axes]
    if not any(shapes):
        return
    held = ", ".join(str(int(np.prod(shape))) for shape in shapes)
    cure = "export them with one number each"
    if len(set(shapes)) == 1 and len(shapes[0]) == 1:
        cure = (
            f"choose one, such as the first: numpy.column_stack([x[axis][..., 0].ravel() for axis in {axes}])"
        )
    raise fault(name, f"its x, y and z are {held} numbers a point, not one number each", cure)


def _numbers(values: NDArray[Any]) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):  # beyond float64 is infinite, and refused as such
        numbers = np.array(np.ma.getdata(values), dtype=np.float64, order="C")
    if np.ma.isMaskedArray(values):
        numbers[np.ma.getmaskarray(values)] = np.nan  # a fill value is not a coordinate
    return numbers


def _as_numbers(array: NDArray[Any]) -> str:
    if array.dtype.kind == "c":
        return "take the real part: x.real"
    try:
        np.ma.getdata(array).ravel()[:1000].astype(np.float64)
    except (TypeError, ValueError):
        return "give an array of numbers, one point a row: numpy.column_stack([x, y, z])"
    return "convert with astype(float)"


def _short(array: NDArray[Any]) -> str:
    return str(array.dtype)[:120]
