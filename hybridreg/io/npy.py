# SPDX-License-Identifier: MIT
"""NumPy's npy files, read without ever unpickling and without trusting the shape they promise."""

from __future__ import annotations

import io
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, foreign_parser, shorten
from hybridreg.io.records import AXES, stack_axes

_SAVE_PLAIN = "save it as a plain float array with numpy.save"


def parse_npy(data: bytes, name: str) -> NDArray[np.float64]:
    """Read an (N, 3 or more) array of numbers, or a structured array with fields x, y, z; shape (N, 3)."""
    return array_points(array_of_npy(data, name), name)


def array_of_npy(data: bytes, name: str) -> NDArray[np.generic]:
    """The array in the npy content `data`, its promised size checked against the bytes that are there."""
    if not data.startswith(b"\x93NUMPY"):
        what = "is a Python pickle, which could run code" if data[:1] == b"\x80" else "is no npy file"
        raise fault(name, f"{what} (it begins with {shorten(data[:8])})", _SAVE_PLAIN)
    shape, fortran, dtype, start = npy_header(data, name)
    if dtype.hasobject:
        raise fault(name, "holds Python objects, which are pickled and could run code", _SAVE_PLAIN)
    promised = math.prod(shape) * dtype.itemsize
    if min(shape, default=0) < 0 or dtype.itemsize == 0 or promised > len(data) - start:
        problem = f"its header promises shape {shape} of {shorten(dtype)}, {promised} bytes"
        raise fault(name, f"{problem}; it holds {len(data) - start}")
    if promised == 0:
        return np.empty(shape, dtype)
    flat = np.frombuffer(data, dtype=dtype, count=math.prod(shape), offset=start)
    return flat.reshape(shape, order="F" if fortran else "C")


def npy_header(data: bytes, name: str) -> tuple[tuple[int, ...], bool, np.dtype[np.generic], int]:
    """Shape, Fortran order, dtype, and the byte where the values begin."""
    stream = io.BytesIO(data)
    with foreign_parser(name, "a NumPy array"):
        version = np.lib.format.read_magic(stream)
        # Version 3 differs from 2 in how names of fields are encoded, and x, y, z are the same in both.
        read = np.lib.format.read_array_header_1_0 if version[0] == 1 else np.lib.format.read_array_header_2_0
        shape, fortran, dtype = read(stream)
    return shape, fortran, dtype, stream.tell()


def array_points(array: NDArray[Any], name: str) -> NDArray[np.float64]:
    """The first three columns, or the fields x, y, z, as float64."""
    if array.dtype.names and array.ndim == 1 and set(AXES) <= set(array.dtype.names):
        columns = [array[axis] for axis in AXES]
    elif array.dtype.names or array.ndim != 2 or array.shape[1] < 3:
        raise fault(name, f"holds {_words(array)}, not a cloud", "save an array of shape (N, 3) or (N, 4)")
    elif array.shape[0] in (3, 4) and array.shape[1] > 4:
        raise fault(name, f"holds {_words(array)}, points as columns", "save its transpose, one point a row")
    else:
        columns = [array[:, axis] for axis in range(3)]
    if any(column.ndim != 1 or column.dtype.kind not in "fiu" for column in columns):
        raise fault(name, f"holds {_words(array)}, not real numbers", _SAVE_PLAIN)
    return stack_axes(*columns)


def _words(array: NDArray[np.generic]) -> str:
    return f"an array of shape {array.shape} and type {shorten(array.dtype)}"
