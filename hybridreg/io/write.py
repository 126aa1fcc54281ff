# SPDX-License-Identifier: MIT
"""Writing clouds, transforms and records, each file whole or not at all."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hybridreg.io.atomic import write_bytes, write_text
from hybridreg.io.faults import fault

_PLY_TYPES = {"float64": "double", "float32": "float"}
_MOST_ROUNDING = 1e-3  # metres, below the noise of any LiDAR


def write_points(
    path: str | os.PathLike[str], points: ArrayLike, *, dtype: Literal["float64", "float32"] | None = None
) -> None:
    """Write a cloud as binary PLY or binary PCD, by the name's ending.

    Parameters
    ----------
    path : path
        Ends in `.ply` or `.pcd`.
    points : array of shape (N, 3)
        Written as they are, even where they are not finite.
    dtype : {"float64", "float32"}, optional
        By default PLY is written as float64, which loses nothing, and PCD as float32, because Open3D silently reads
        the coordinates of a float64 PCD as zeros. A PCD whose points float32 would move by
        more than a millimetre (map-grid coordinates) is refused unless a dtype is given.

    Raises
    ------
    ValueError
        Another ending, points of another shape, or map-grid coordinates in a PCD without `dtype`.
    """
    array, suffix = np.asarray(points), Path(path).suffix.lower()
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind not in "fiu":
        problem = f"the points to write have the shape {array.shape} and the dtype {array.dtype}"
        # A cloud of ours counts its points from its offset.
        ours = hasattr(points, "points") and hasattr(points, "offset")
        cure = "give cloud.points + cloud.offset" if ours else "give real numbers of shape (N, 3)"
        raise fault(str(path), problem, cure)
    if suffix not in (".ply", ".pcd"):
        raise fault(
            str(path), f"clouds are not written as {suffix!r}", "choose a name ending in .ply or .pcd"
        )
    kind = dtype or ("float64" if suffix == ".ply" else _checked_float32(array, str(path)))
    if kind not in _PLY_TYPES:
        raise fault(
            str(path), f"points cannot be written as {kind!r}", f"choose from {', '.join(_PLY_TYPES)}"
        )
    header = _ply_header(len(array), kind) if suffix == ".ply" else _pcd_header(len(array), kind)
    write_bytes(path, header.encode("ascii") + _little_endian(array, kind))


def write_matrix(path: str | os.PathLike[str], matrix: ArrayLike) -> None:
    """Write a (4, 4) transform as four lines of text that `numpy.loadtxt` reads back bit for bit.

    Raises
    ------
    ValueError
        Another shape, or an entry that is not finite.
    """
    array = np.asarray(matrix, dtype=np.float64)
    if array.shape != (4, 4) or not np.isfinite(array).all():
        problem = (
            f"the transform to write has the shape {array.shape}, {(~np.isfinite(array)).sum()} not finite"
        )
        raise fault(str(path), problem, "give finite numbers of shape (4, 4)")
    rows = (" ".join(repr(float(value)) for value in row) for row in array)
    write_text(path, "\n".join(rows) + "\n")


def write_json(path: str | os.PathLike[str], record: object) -> None:
    """Write `record` as indented JSON; NumPy arrays and numbers, tuples and paths are converted.

    Raises
    ------
    ValueError
        A NaN or an infinity, which JSON does not have, or an object that JSON cannot represent.
    """
    try:
        text = json.dumps(record, indent=2, allow_nan=False, ensure_ascii=False, default=_plain)
    except (TypeError, ValueError, RecursionError) as error:
        raise fault(
            str(path), f"cannot be written as JSON: {error}", "use numbers, texts, lists, None"
        ) from error
    write_text(path, text + "\n")


def _plain(thing: object) -> Any:
    if isinstance(thing, (np.ndarray, np.generic)):
        return thing.tolist()
    if isinstance(thing, os.PathLike):
        return os.fspath(thing)
    raise TypeError(f"an object of type {type(thing).__name__}")


def _checked_float32(points: NDArray[Any], name: str) -> str:
    finite = points[np.isfinite(points)].astype(np.float64)
    with np.errstate(over="ignore"):
        moved = np.abs(finite.astype(np.float32) - finite)
    if (moved > _MOST_ROUNDING).any():
        problem = f"float32 would move coordinates of up to {np.abs(finite).max():g} by {moved.max():.3g} m"
        raise fault(name, problem, "write .ply, subtract an offset, or ask for a dtype")
    return "float32"


def _little_endian(points: NDArray[Any], dtype: str) -> bytes:
    with np.errstate(over="ignore"):  # beyond float32's range, on request: infinity
        return points.astype(np.dtype(dtype).newbyteorder("<")).tobytes()


def _ply_header(count: int, dtype: str) -> str:
    axes = "".join(f"property {_PLY_TYPES[dtype]} {axis}\n" for axis in "xyz")
    return f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{axes}end_header\n"


def _pcd_header(count: int, dtype: str) -> str:
    size = np.dtype(dtype).itemsize
    return (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\n"
        f"SIZE {size} {size} {size}\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {count}\nHEIGHT 1\n"
        f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    )
