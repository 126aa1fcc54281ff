# SPDX-License-Identifier: MIT
"""NumPy's npz archives: which of their arrays is the cloud."""

from __future__ import annotations

import io
import re
import zipfile

import numpy as np
from numpy.typing import NDArray

from hybridreg.io import tables
from hybridreg.io.arrays import array_points
from hybridreg.io.column_names import find_axes, stem_and_unit
from hybridreg.io.coordinate_systems.length_unit import in_metres
from hybridreg.io.faults import fault, foreign_parser, shorten
from hybridreg.io.formats.npy import array_of_npy, npy_header
from hybridreg.io.meaning.beside_points import (
    changes_points,
    is_no_points,
    refuse_second_cloud,
    with_what_is_beside,
)
from hybridreg.io.meaning.first_column import FEWEST
from hybridreg.io.meaning.image_shapes import is_image
from hybridreg.io.meaning.length_units import unit_given
from hybridreg.io.meaning.unit_words import known_metres

_UNITS = ("unit", "units", "length_unit")
_UNNAMED = re.compile(
    r"arr_[1-9]\d*"
)  # what numpy.savez calls the second array without a name, and those after it
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
        names = [member[:-4] for member in archive.namelist() if member.endswith(".npy")]
        beside = _numbers(archive, [key for key in names if key not in keys and changes_points(key)], name)
        unnamed = [key for key in names if _UNNAMED.fullmatch(key)] if keys == ["arr_0"] else []
        others = _numbers(archive, unnamed, name).items()
        with foreign_parser(name, "a zip archive of arrays"):
            words = {
                each: archive.read(f"{each}.npy") for each in _UNITS if f"{each}.npy" in archive.namelist()
            }
    single = len(keys) == 1
    points = (
        array_points(arrays[keys[0]], _label(name, keys[0])) if single else tables.points(arrays, keys, name)
    )
    if single and keys[0] == "arr_0":
        refuse_second_cloud(points, others, name)
    points = with_what_is_beside(points, beside, name)
    said = known_metres(stem_and_unit(keys[0])[1]) if single else None
    if said is None:
        said = unit_given({each: _text(words[each], name) for each in words}, name)
    return in_metres(points, said, name)


def _numbers(archive: zipfile.ZipFile, wanted: list[str], name: str) -> dict[str, NDArray[np.generic]]:
    """Those of the arrays that hold plain numbers."""
    return {
        key: _array(archive, key, name) for key in wanted if _shape_and_kind(archive, key, name)[1] in "fiub"
    }


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
    for wanted in _KEYS:
        if wanted in keys:
            return [wanted]
        in_unit = [
            key for key in keys if (parsed := stem_and_unit(key))[0] == wanted and known_metres(parsed[1])
        ]
        if len(in_unit) == 1:
            return in_unit
    shapes = {key: _shape_and_kind(archive, key, name)[0] for key in keys}
    flat = [key for key, shape in shapes.items() if len(shape) == 2 and shape[1] >= 3]
    # A depth image or a matrix beside the cloud is no second cloud; alone it is refused as what it is.
    clouds = [key for key in flat if not is_image(*shapes[key]) and max(shapes[key]) >= FEWEST]
    axes = None if clouds else find_axes(keys, name)
    if axes is not None:
        return [keys[column] for column in axes.columns]
    if len(keys) == 1 and len(shapes[keys[0]]) == 1:
        return keys  # records, or numbers in one row, of which `array_points` tells
    fitting = [key for key in clouds or flat if not is_no_points(stem_and_unit(key)[0])]
    if len(fitting) != 1:
        held = ", ".join(f"{key} {shape}" for key, shape in shapes.items()) or "no array"
        problem = f"has no array {' or '.join(_KEYS)}, and {len(fitting)} of shape (N, 3) under other names"
        if clouds and not fitting:
            problem = f"has no points: {shorten(', '.join(clouds))} is something else by its name"
        raise fault(name, f"{problem}; it holds {held[:200]}", "save the cloud as the array 'xyz'")
    return fitting


def _shape_and_kind(archive: zipfile.ZipFile, key: str, name: str) -> tuple[tuple[int, ...], str]:
    label = _label(name, key)
    with foreign_parser(label, "a zip archive of arrays"), archive.open(f"{key}.npy") as member:
        head = member.read(_LONGEST_HEADER)
    shape, _, dtype, _ = npy_header(head, label)
    return shape, dtype.kind
