# SPDX-License-Identifier: MIT
"""Reading a pose that a person or this library wrote down."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.coordinate_systems.length_unit import in_metres
from hybridreg.io.faults import fault, shorten
from hybridreg.io.formats.npy import array_of_npy
from hybridreg.io.meaning.length_units import unit_given
from hybridreg.io.poses.pose_from_text import pose_of_text
from hybridreg.io.poses.pose_numbers import EXPECTED, pose_of_numbers
from hybridreg.io.signatures import kind_of, looks_binary
from hybridreg.io.structured import read_json
from hybridreg.io.whole_files import read_whole

# What the field, the library's own results among them, calls a pose in JSON.
_KEYS = ("T_target_source", "transformation", "T")
# Where it is in parts: of nuScenes, whose quaternions have w first, of ROS and of others.
_PLACES = ("translation", "position", "t")
_SEVEN = '"T_target_source": [x, y, z, qx, qy, qz, qw]'
_NPY = b"\x93NUMPY"


def read_pose(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """A pose (4, 4) from text in any form that the library writes (`hybridreg.output.pose_text.FORMATS`), from JSON (a
    matrix, or a `result.json`), or from an array in `.npy`.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        No pose, several, or another count of numbers; the message names the file and says what is expected.
    """
    name = os.fspath(path)
    if name.lower().endswith(".json"):
        values = read_json(path)
        T = pose_of_numbers(_of_json(values, name), name)
        T[:3, 3] = in_metres(T[None, :3, 3], unit_given(values, name), name)[0]
        return T
    data = read_whole(Path(path))
    if data.startswith(_NPY):
        return pose_of_numbers(array_of_npy(data, name), name)
    if looks_binary(data):
        kind = kind_of(data)
        raise fault(
            name, f"is {kind.words if kind else 'not text'}, not a pose", f"{EXPECTED}; or as .npy or .json"
        )
    return pose_of_text(data.decode("utf-8-sig", "replace"), name)


def _of_json(values: Any, name: str) -> Any:
    if not isinstance(values, dict):
        return values
    found = next((key for key in _KEYS if key in values), None)
    if found is None and "T_source_target" in values:
        cure = "invert it with numpy.linalg.inv, and call that T_target_source"
        raise fault(name, "its T_source_target maps target points to source points", cure)
    if found is None:
        problem = f"has no entry {' or '.join(_KEYS)} among {shorten(', '.join(values), 200)}"
        matrix = "call the matrix, four rows of four numbers, T_target_source"
        apart = any(str(key).lower() in _PLACES for key in values)
        raise fault(name, problem, f"give {_SEVEN}, w last, or {matrix}" if apart else matrix)
    return values[found]
