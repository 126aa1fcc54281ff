# SPDX-License-Identifier: MIT
"""The kind of a file by its first bytes, whatever its name says."""

from __future__ import annotations

import re
from dataclasses import dataclass

from hybridreg.io.faults import FETCH_AGAIN

_UNPACK = "unpack it first"
_NO_CLOUD = "give the point cloud's own file"


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A recognised kind of file.

    `suffix` is set where another of our readers takes it; `cure` says what to do with the others.
    """

    words: str
    cure: str = _NO_CLOUD
    suffix: str = ""


_KINDS: tuple[tuple[bytes, Kind], ...] = (
    (b"ply\n", Kind(words="a PLY file", suffix=".ply")),
    (b"ply\r", Kind(words="a PLY file", suffix=".ply")),
    (b"# .PCD", Kind(words="a PCD file", suffix=".pcd")),
    (b"\x93NUMPY", Kind(words="a NumPy array", suffix=".npy")),
    (b"LASF", Kind(words="a LAS file", suffix=".las")),
    (b"~V", Kind(words="a log of a well (the other LAS, of the CWLS)")),
    (b"~v", Kind(words="a log of a well (the other LAS, of the CWLS)")),
    (b"CCB", Kind(words="CloudCompare's own format", cure="save it there as .ply or .las")),
    (b"ASTM-E57", Kind(words="an E57 file", suffix=".e57")),
    (b"PAR1", Kind(words="a Parquet table", suffix=".parquet")),
    (b"ARROW1", Kind(words="an Arrow table", suffix=".feather")),
    (b"FEA1", Kind(words="a Feather table, version 1", suffix=".feather")),
    (b"livox_tech", Kind(words="a recording of Livox Viewer", suffix=".lvx2")),
    (b"glTF", Kind(words="a binary glTF scene", suffix=".glb")),
    (b"\x89MCAP0\r\n", Kind(words="an MCAP recording", suffix=".mcap")),
    (b"MATLAB 5.0", Kind(words="a MATLAB file", cure="save the array in it as .csv")),
    (b"PK\x03\x04", Kind(words="a zip archive", cure=_UNPACK, suffix=".npz")),
    (b"\x1f\x8b\x08", Kind(words="compressed with gzip", cure=_UNPACK)),
    (b"BZh", Kind(words="compressed with bzip2", cure=_UNPACK)),
    (b"\xfd7zXZ\x00", Kind(words="compressed with xz", cure=_UNPACK)),
    (b"\x28\xb5\x2f\xfd", Kind(words="compressed with zstd", cure=_UNPACK)),
    (b"7z\xbc\xaf\x27\x1c", Kind(words="a 7z archive", cure=_UNPACK)),
    (b"\xff\xd8\xff", Kind(words="a JPEG image")),
    (b"\x89PNG\r\n", Kind(words="a PNG image")),
    (b"GIF8", Kind(words="a GIF image")),
    (b"%PDF-", Kind(words="a PDF document")),
    (b"\x89HDF\r\n", Kind(words="an HDF5 file", cure="export the points as .ply or .npy")),
    (b"#ROSBAG", Kind(words="a ROS bag", suffix=".bag")),
    (b"SQLite format 3", Kind(words="a database (a ROS 2 bag?)", suffix=".db3")),
    (b"version https://git-lfs", Kind(words="a Git LFS pointer, not the data", cure="run `git lfs pull`")),
    (b"version https://hawser", Kind(words="a Git LFS pointer, not the data", cure="run `git lfs pull`")),
)
_POLY_DATA = Kind(words="a surface or cloud of VTK", suffix=".vtp")
_OTHER_VTK = Kind(
    words="data of VTK that are no surface or cloud",
    cure="save their surface as .vtp, for example by ParaView's Extract Surface",
)
_VTK = re.compile(rb"<VTKFile\b[^>]*?\btype\s*=\s*[\"'](\w+)")
_WEB_PAGE = Kind(words="a web page, probably an error message of the server", cure=FETCH_AGAIN)


def kind_of(data: bytes) -> Kind | None:
    """The kind of file that begins with `data`; None where no signature fits."""
    for signature, kind in _KINDS:
        if data.startswith(signature):
            return kind
    opening = data[:256].lstrip(b"\xef\xbb\xbf \t\r\n").lower()
    vtk = _VTK.search(data[:4096])
    if vtk and opening.startswith((b"<?xml", b"<!--", b"<vtkfile")):
        return _POLY_DATA if vtk.group(1) == b"PolyData" else _OTHER_VTK
    if opening.startswith((b"<!doctype", b"<html", b"<?xml", b"<head")):
        return _WEB_PAGE
    return None


def looks_like_text(data: bytes) -> bool:
    """Whether the first 512 bytes are printable ASCII, as no float32 cloud's are."""
    head = data[:512]
    return bool(head) and all(32 <= byte < 127 or byte in (9, 10, 13) for byte in head)


def looks_binary(data: bytes) -> bool:
    """Whether the first 4096 bytes hold a zero byte, as no text in ASCII, UTF-8 or Latin-1 does."""
    return b"\x00" in data[:4096]
