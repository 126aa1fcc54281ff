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
from hybridreg.io.formats.ply import SPLATS, parse_ply
from hybridreg.io.formats.text import parse_text
from hybridreg.io.recorded.arrow_tables import read_arrow
from hybridreg.io.recorded.bag_reader import read_bag
from hybridreg.io.recorded.e57_scans import read_e57
from hybridreg.io.recorded.helipr_records import is_helipr, read_helipr
from hybridreg.io.recorded.lvx2 import read_lvx2
from hybridreg.io.recorded.mesh_surface import read_mesh
from hybridreg.io.recorded.recording import ANY, Recorded, Selection
from hybridreg.io.recorded.vtk_surface import read_vtp
from hybridreg.io.signatures import kind_of
from hybridreg.io.whole_files import check_file, read_whole

# Bytes within which the header of a PCD file ends, and those that show what a file is.
_HEADER, _OPENING = 65_536, 4096
# Endings of one format.
_ALIKE = {".laz": ".las", ".arrow": ".feather"}
# Endings whose files always begin with their signature; what does not is not given to other people's readers.
_SIGNED = (".e57", ".bag", ".db3", ".mcap", ".parquet", ".feather", ".glb", ".lvx2", ".vtp")

# Files that hold points or surfaces, and are not read: what to do instead.
_ELSEWHERE = {
    ".ptx": "export it as .ply or .pts, for example with CloudCompare",
    ".rcp": "export it as .pts or .e57 in ReCap, and that as .ply",
    **dict.fromkeys(
        (".pcap", ".pcapng"), "convert one frame with the sensor's own tool to .csv, .pcd or .las"
    ),
    ".osf": "save one frame with `ouster-cli source FILE slice 0:1 save OUT.ply`",
    ".lvx": "convert it with Livox Viewer 2 to .lvx2 or .las",
    ".vtk": "save it as .vtp or .ply, for example with ParaView",
    ".vtu": "save its surface as .vtp or .ply, for example by ParaView's Extract Surface",
    ".pvtp": "it names pieces in other files: give one of those, or save all as one .vtp",
    ".mat": "save the array in it as .csv or .npy",
    **dict.fromkeys(
        (".h5", ".hdf5", ".hdf", ".nc", ".nc4", ".zarr", ".pkl", ".pickle", ".pt", ".pth"),
        "save the array in it as .npy",
    ),
    **dict.fromkeys((".splat", ".spz", ".ksplat", ".sog"), SPLATS),
    **dict.fromkeys(
        (".fls", ".zfs", ".rxp", ".rcs", ".rdbx", ".lsproj", ".tzf", ".imp", ".ptg"),
        "export it as .e57 with the scanner's own program",
    ),
    **dict.fromkeys(
        (".tif", ".tiff", ".dem", ".hgt", ".dt0", ".dt1", ".dt2", ".img", ".vrt", ".jp2"),
        "if it holds heights: gdal_translate -of XYZ IN out.xyz, of degrees after gdalwarp -t_srs EPSG:CODE IN OUT",
    ),
    **dict.fromkeys(
        (".all", ".kmall", ".gsf", ".s7k", ".xtf"),
        "export its soundings as text: easting, northing and height in metres",
    ),
    **dict.fromkeys(
        (".ifc", ".rvt", ".skp", ".dwg", ".dxf", ".3dm", ".step", ".stp", ".iges", ".igs")
        + (".fbx", ".dae", ".blend", ".wrl", ".x3d", ".3ds", ".usd", ".usda", ".usdc", ".usdz"),
        "export its surface as .ply or .obj, in metres, from the program that made it",
    ),
    # Mostly in degrees, GeoJSON and KML always.
    **dict.fromkeys(
        (".gpkg", ".shp", ".geojson", ".gml", ".kml", ".kmz", ".fgb"),
        "convert it: ogr2ogr -f CSV -t_srs EPSG:CODE out.csv IN -lco GEOMETRY=AS_XYZ, with the code of a system in "
        "metres, such as EPSG:32632 of UTM's zone 32 north",
    ),
    **dict.fromkeys((".json", ".tfrecord", ".rrd"), "save the points of one cloud in it as .npy or .csv"),
    **dict.fromkeys(
        (".svo", ".svo2", ".mkv", ".oni", ".r3d"),
        "save one frame's points, unprojected from its depths, as .ply or .npy",
    ),
    ".zdf": "save it as .ply or .pcd with the camera's own program",
    ".drc": "decode it: draco_decoder -i in.drc -o out.ply",
    ".active": "its recording was cut off: run `rosbag reindex` on it, and rename it to end in .bag",
    ".zstd": "of a ROS 2 bag give the folder, unpack anything else first",
    ".yaml": "of a ROS 2 bag give the folder",
    **dict.fromkeys(
        (".gz", ".bz2", ".xz", ".zst", ".lz4", ".zip", ".7z", ".rar", ".tar", ".tgz"), "unpack it first"
    ),
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
"""The reader of each file name ending, of a file's content."""

Reader = Callable[[Path, Selection], Recorded]

READERS: dict[str, Reader] = {
    **dict.fromkeys((".bag", ".db3", ".mcap"), read_bag),
    ".e57": read_e57,
    ".lvx2": read_lvx2,
    **dict.fromkeys((".feather", ".arrow", ".parquet"), read_arrow),
    **dict.fromkeys((".obj", ".stl", ".off", ".glb", ".gltf"), read_mesh),
    ".vtp": read_vtp,
}
"""Readers that go to the file themselves, through other packages; of several clouds in one file they may choose one."""

_OF_BAG, _OF_SCANS = ("topic", "index", "at", "accumulate"), ("index", "accumulate")
# By what one is chosen among the clouds of a file.
_SEVERAL = {
    **dict.fromkeys((".bag", ".db3", ".mcap"), _OF_BAG),
    **dict.fromkeys((".e57", ".lvx2"), _OF_SCANS),
}


def read_points(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Read the coordinates of a point cloud in the file's own frame, converted to metres where the file gives a unit.

    The file name's ending chooses the format: `.ply` (ascii, binary), `.pcd` (ascii, binary,
    binary_compressed), `.bin` (float32 rows of three to sixteen numbers, as KITTI and nuScenes have four and five),
    `.npy`, `.npz` (array `xyz`, `points`, `arr_0`, the only one that fits, or `x`, `y` and `z`), text (`.xyz`, `.txt`,
    `.csv`, `.tsv`, `.asc`, `.pts`, `.xyzn`, `.xyzrgb`, `.xyzi`), `.las`/`.laz` (extra `las`; COPC too), and what
    `READERS` lists: bags (extra `ros`), `.e57` (extra `e57`), `.lvx2`, Arrow's tables (extra `arrow`), meshes (extra
    `mesh`) and `.vtp` (extra `vtk`); of several clouds the first.
    A file that is not what its name says is refused. Rows that are not finite are kept: the gate decides about them.

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
        The package that reads it is not installed; the message names the extra that brings it.
    """
    return read_recorded(path).points


def read_recorded(path: str | os.PathLike[str], selection: Selection = ANY) -> Recorded:
    """As `read_points`, with where the points were seen from, and one cloud chosen where a file holds several.

    Raises
    ------
    ValueError
        Also where a cloud is chosen from a file that holds one, or by what its kind of file does not have.
    """
    if not os.fspath(path):
        raise fault(repr(path), "the path of the cloud is empty", "give that of a file")
    path = Path(path)
    if _is_folder(path) and (path / "metadata.yaml").is_file():
        return read_bag(path, selection)
    check_file(path)
    suffix = _suffix(str(path))
    if suffix in READERS or suffix in PARSERS:
        _check_choice(path, selection)
    if is_helipr(path):
        return read_helipr(path, selection)
    if suffix in READERS:
        with open(path, "rb") as file:
            _check_kind(_filled(file.read(_OPENING), str(path)), str(path))
        return READERS[suffix](path, selection)
    _parser_for(str(path))  # before the reading, which may be long
    return Recorded(parse_points(read_whole(path), str(path)))


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # a name that no file can have: `check_file` says so
        return False


def choices_in(path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Names of those fields of a `Selection` by which one cloud is chosen from a file; none where it holds but one."""
    return _OF_BAG if _is_folder(Path(path)) else _SEVERAL.get(_suffix(os.fspath(path)), ())


def _check_choice(path: Path, selection: Selection) -> None:
    known = choices_in(path)
    useless = ", ".join(f"{key}={value!r}" for key, value in selection.made().items() if key not in known)
    if useless:
        held = f"several clouds, of which {' and '.join(known)} choose one" if known else "one cloud"
        raise fault(str(path), f"holds {held}; {useless} chooses nothing there", "leave that out")


def read_viewpoint(path: str | os.PathLike[str]) -> NDArray[np.float64] | None:
    """Where the sensor stood, (3,) among the points that `read_points` gives, as a `.pcd` file may tell; else None.

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
    _check_kind(_filled(data, name), name)
    return parser(data, name)


def _filled(data: bytes, name: str) -> bytes:
    if not data:
        raise fault(name, "is empty (0 bytes)")
    return data


def _parser_for(name: str) -> Parser:
    suffix = _suffix(name)
    if suffix in READERS:
        raise fault(name, f"a {suffix} is read from its file only", "give its path")
    if suffix not in PARSERS:
        cure = f"; {_ELSEWHERE[suffix]}" if suffix in _ELSEWHERE else ""
        raise fault(
            name,
            f"there is no reader for {suffix!r}{cure}",
            f"what is read ends in {', '.join([*PARSERS, *READERS])}",
        )
    return PARSERS[suffix]


def _suffix(name: str) -> str:
    return Path(name).suffix.lower()


def _check_kind(data: bytes, name: str) -> None:
    found = kind_of(data)
    expected = _ALIKE.get(_suffix(name), _suffix(name))
    if found is None and expected in _SIGNED:
        raise fault(name, f"does not begin as a file called {expected} does")
    if found is None or found.suffix == expected:
        return
    readable = found.suffix in PARSERS or found.suffix in READERS
    cure = f"rename it to end in {found.suffix}" if readable else found.cure
    raise fault(name, f"its content is {found.words}, not what the ending {_suffix(name)} says", cure)
