# SPDX-License-Identifier: MIT
"""NumPy's npy files, read without ever unpickling and without trusting the shape they promise."""

from __future__ import annotations

import io
import math

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.arrays import array_points
from hybridreg.io.faults import fault, foreign_parser, shorten

_SAVE_PLAIN = "save it as a plain float array with numpy.save"


def parse_npy(data: bytes, name: str) -> NDArray[np.float64]:
    """The points of the one array in the file, of any layout that `array_points` takes; shape (N, 3)."""
    return array_points(array_of_npy(data, name), name)


def array_of_npy(data: bytes, name: str) -> NDArray[np.generic]:
    """The array in the npy content `data`; its promised size is checked against the bytes present."""
    if not data.startswith(b"\x93NUMPY"):
        what = "is a Python pickle, which could run code" if data[:1] == b"\x80" else "is not an npy file"
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
