# SPDX-License-Identifier: MIT
"""Reading a cloud from a file of any supported format."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault
from hybridreg.io.formats.bin import parse_bin
from hybridreg.io.formats.las import parse_las
from hybridreg.io.formats.npy import parse_npy
from hybridreg.io.formats.npz import parse_npz
from hybridreg.io.formats.pcd import parse_pcd, pcd_viewpoint
from hybridreg.io.formats.ply import parse_ply
from hybridreg.io.formats.text import parse_text
from hybridreg.io.signatures import kind_of
from hybridreg.io.whole_files import check_file, read_whole

# Bytes in which the header of a PCD file ends.
_HEADER = 65_536

# Files that hold points or surfaces, and are not read: what to do instead.
_MESH = "sample its surface first (for example trimesh.load(file, force='mesh').sample(100_000)) and save that as .npy"
_FRAME = "save it as .csv, or in Python read it with pandas and pass the DataFrame"
_ELSEWHERE = {
    ".e57": "export it as .ply or .las, for example with CloudCompare",
    ".ptx": "export it as .ply or .pts, for example with CloudCompare",
    ".rcp": "export it as .pts or .e57 in ReCap, and that as .ply",
    ".bag": "export one scan of it as .pcd or .npy",
    ".mcap": "export one scan of it as .pcd or .npy",
    ".pcap": "convert one frame with the sensor's own tool to .csv, .pcd or .las",
    ".mat": "save the array in it as .csv or .npy",
    ".h5": "save the array in it as .npy",
    **dict.fromkeys((".stl", ".obj", ".off", ".glb", ".gltf"), _MESH),
    **dict.fromkeys((".feather", ".parquet", ".arrow"), _FRAME),
}

Parser = Callable[[bytes, str], NDArray[np.float64]]

PARSERS: dict[str, Parser] = {
    ".ply": parse_ply,
    ".pcd": parse_pcd,
    ".bin": parse_bin,
    ".npy": parse_npy,
    ".npz": parse_npz,
    **dict.fromkeys(
        (".xyz", ".txt", ".csv", ".tsv", ".asc", ".pts", ".xyzn", ".xyzrgb", ".xyzi"), parse_text
    ),
    ".las": parse_las,
    ".laz": parse_las,
}
"""The reader of each file name ending."""


def read_points(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Read the coordinates of a point cloud in the file's own frame, converted to metres where the file gives a unit.

    The file name's ending chooses the format: `.ply` (ascii, binary), `.pcd` (ascii, binary,
    binary_compressed), `.bin` (float32 rows of three to six numbers, as KITTI and nuScenes have four and five),
    `.npy`, `.npz` (array `xyz`, `points`, `arr_0` or the only one that fits), text (`.xyz`, `.txt`, `.csv`, `.tsv`,
    `.asc`, `.pts`, `.xyzn`, `.xyzrgb`, `.xyzi`), `.las`/`.laz` (extra `las`).
    A file that is not what its name says is refused. Rows that are not finite are kept: the gate deals with them.

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
    """Where the sensor stood, (3,) in the file's own frame and unit, as a `.pcd` file may give it; otherwise None.

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
        cure = f"; {_ELSEWHERE[suffix]}" if suffix in _ELSEWHERE else ""
        raise fault(
            name, f"there is no reader for {suffix!r}{cure}", f"what is read ends in {', '.join(PARSERS)}"
        )
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
