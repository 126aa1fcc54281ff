# SPDX-License-Identifier: MIT
"""NumPy's npz archives: which of their arrays is the cloud."""

from __future__ import annotations

import io
import zipfile

import numpy as np
from numpy.typing import NDArray

from hybridreg.io import tables
from hybridreg.io.arrays import array_points
from hybridreg.io.column_names import find_axes
from hybridreg.io.coordinate_systems.length_unit import in_metres
from hybridreg.io.faults import fault, foreign_parser
from hybridreg.io.formats.npy import array_of_npy, npy_header
from hybridreg.io.meaning.first_column import FEWEST
from hybridreg.io.meaning.image_shapes import is_image
from hybridreg.io.meaning.length_units import unit_given

_UNITS = ("unit", "units", "length_unit")
_KEYS = ("xyz", "points", "arr_0")
_MODEST = 2**28  # bytes that are unpacked in any case
# Coordinates hardly compress (up to 20 times on a coarse grid); noise of zeros compresses a thousandfold.
_MOST_EXPANSION = 200
_LONGEST_HEADER = 16384  # numpy itself refuses headers above 10000 bytes


def parse_npz(data: bytes, name: str) -> NDArray[np.float64]:
    """Read the array `xyz`, else `points`, else `arr_0`, else the only (N, 3 or more) one, else the arrays `x`, `y` and
    `z`; shape (N, 3)."""
    with foreign_parser(name, "a zip archive of arrays"):
        archive = zipfile.ZipFile(io.BytesIO(data))
    with archive:
        keys = _cloud_keys(archive, name)
        arrays = {key: _array(archive, key, name) for key in keys}
        with foreign_parser(name, "a zip archive of arrays"):
            words = {
                each: archive.read(f"{each}.npy") for each in _UNITS if f"{each}.npy" in archive.namelist()
            }
    single = len(keys) == 1
    points = (
        array_points(arrays[keys[0]], _label(name, keys[0])) if single else tables.points(arrays, keys, name)
    )
    return in_metres(points, unit_given({each: _text(words[each], name) for each in words}, name), name)


def _text(content: bytes, name: str) -> str:
    # A word is kept as an array of one; an array of numbers that is called so says nothing.
    array = array_of_npy(content, name) if npy_header(content, name)[2].kind in "US" else np.empty(0)
    return str(array.astype("U").item()) if array.size == 1 else ""


def _label(name: str, key: str) -> str:
    return f"{name} (array {key!r})"


def _array(archive: zipfile.ZipFile, key: str, name: str) -> NDArray[np.generic]:
    label = _label(name, key)
    _refuse_bomb(archive.getinfo(f"{key}.npy"), label)
    with foreign_parser(name, "a zip archive of arrays"):
        content = archive.read(f"{key}.npy")
    return array_of_npy(content, label)


def _refuse_bomb(member: zipfile.ZipInfo, label: str) -> None:
    # zipfile unpacks no more than the directory promises, so it is the promise that has to be plausible.
    packed, unpacked = member.compress_size, member.file_size
    if unpacked > _MODEST and unpacked > _MOST_EXPANSION * packed:
        raise fault(label, f"would unpack from {packed} to {unpacked} bytes, as no cloud does")


def _cloud_keys(archive: zipfile.ZipFile, name: str) -> list[str]:
    """The one array that holds the cloud, or those of x, y and z."""
    keys = [member[:-4] for member in archive.namelist() if member.endswith(".npy")]
    for key in _KEYS:
        if key in keys:
            return [key]
    shapes = {key: _shape(archive, key, name) for key in keys}
    flat = [key for key, shape in shapes.items() if len(shape) == 2 and shape[1] >= 3]
    # A depth image or a matrix beside the cloud is no second cloud; alone it is refused as what it is.
    clouds = [key for key in flat if not is_image(*shapes[key]) and max(shapes[key]) >= FEWEST]
    axes = None if clouds else find_axes(keys, name)
    if axes is not None:
        return [keys[column] for column in axes.columns]
    if len(keys) == 1 and len(shapes[keys[0]]) == 1:
        return keys  # records, or numbers in one row, of which `array_points` tells
    fitting = clouds or flat
    if len(fitting) != 1:
        held = ", ".join(f"{key} {shape}" for key, shape in shapes.items()) or "no array"
        problem = f"has no array {' or '.join(_KEYS)}, and {len(fitting)} of shape (N, 3) under other names"
        raise fault(name, f"{problem}; it holds {held[:200]}", "save the cloud as the array 'xyz'")
    return fitting


def _shape(archive: zipfile.ZipFile, key: str, name: str) -> tuple[int, ...]:
    label = _label(name, key)
    with foreign_parser(label, "a zip archive of arrays"), archive.open(f"{key}.npy") as member:
        head = member.read(_LONGEST_HEADER)
    shape, _, _, _ = npy_header(head, label)
    return shape
