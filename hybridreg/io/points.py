# SPDX-License-Identifier: MIT
"""Reading a cloud from a file of any supported format."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.bin import parse_bin
from hybridreg.io.faults import fault
from hybridreg.io.files import check_file, read_whole
from hybridreg.io.las import parse_las
from hybridreg.io.npy import parse_npy
from hybridreg.io.npz import parse_npz
from hybridreg.io.pcd import parse_pcd, pcd_viewpoint
from hybridreg.io.ply import parse_ply
from hybridreg.io.signatures import kind_of
from hybridreg.io.text import parse_text

# Bytes in which the header of a PCD file ends.
_HEADER = 65_536

Parser = Callable[[bytes, str], NDArray[np.float64]]

PARSERS: dict[str, Parser] = {
    ".ply": parse_ply,
    ".pcd": parse_pcd,
    ".bin": parse_bin,
    ".npy": parse_npy,
    ".npz": parse_npz,
    ".xyz": parse_text,
    ".txt": parse_text,
    ".csv": parse_text,
    ".las": parse_las,
    ".laz": parse_las,
}
"""The reader of each file name ending."""


def read_points(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Read the coordinates of a point cloud, in the file's own unit and frame.

    The file name's ending chooses the format: `.ply` (ascii, binary), `.pcd` (ascii, binary,
    binary_compressed), `.bin` (float32 rows of four as in KITTI, or of five as in nuScenes' `.pcd.bin`),
    `.npy`, `.npz` (array `xyz`, `points`, `arr_0` or the only one that fits), `.xyz`/`.txt`/`.csv`,
    `.las`/`.laz` (extra `las`). A file that is not what its name says is refused. Rows that are not finite
    are kept: the gate decides about them.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    array of shape (N, 3), float64
        Doubles in the file stay doubles, so map-grid coordinates keep their millimetres. N may be 0.

    Raises
    ------
    FileNotFoundError, IsADirectoryError
        Nothing, or a folder, lies at `path`.
    ValueError
        The file is damaged, truncated, of an unknown kind, or not what its name says; the message names the
        file, the number that is wrong and the cure.
    ImportError
        `.las`/`.laz` without laspy.
    """
    path = Path(path)
    check_file(path)
    _parser_for(str(path))  # before the reading, which may be long
    return parse_points(read_whole(path), str(path))


def read_viewpoint(path: str | os.PathLike[str]) -> NDArray[np.float64] | None:
    """Where the sensor stood, (3,) in the file's own frame and unit, as a `.pcd` file may tell; else None.

    Raises
    ------
    ValueError
        A PCD header that cannot be read.
    """
    if _suffix(os.fspath(path)) != ".pcd":
        return None
    with open(path, "rb") as file:
        return pcd_viewpoint(file.read(_HEADER), os.fspath(path))


def parse_points(data: bytes, name: str) -> NDArray[np.float64]:
    """Read the content `data` of the file called `name`; as `read_points`, without touching the disk."""
    parser = _parser_for(name)
    if not data:
        raise fault(name, "is empty (0 bytes)")
    _check_kind(data, name)
    return parser(data, name)


def _parser_for(name: str) -> Parser:
    suffix = _suffix(name)
    if suffix not in PARSERS:
        raise fault(name, f"there is no reader for {suffix!r}", f"convert it to one of {', '.join(PARSERS)}")
    return PARSERS[suffix]


def _suffix(name: str) -> str:
    return Path(name).suffix.lower()


def _check_kind(data: bytes, name: str) -> None:
    found = kind_of(data)
    expected = _suffix(name).replace(".laz", ".las")
    if found is None or found.suffix == expected:
        return
    cure = f"rename it to end in {found.suffix}" if found.suffix in PARSERS else found.cure
    raise fault(name, f"its content is {found.words}, not what the ending {_suffix(name)} says", cure)
