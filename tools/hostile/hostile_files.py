# SPDX-License-Identifier: MIT
"""Cloud files of every format, damaged or misnamed, and paths without a file."""

from __future__ import annotations

import io
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import ClassVar

import numpy as np
from hypothesis import strategies as st

from hybridreg import PointCloud
from hybridreg.io import read_points, write_points
from hybridreg.testing import sample_pair
from tools.hostile.damage import Damage, damaged, damages

PATHS = (
    "missing.ply",
    "folder.ply",
    "pipe.pcd",
    "loop.npy",
    "no-ending",
    "nul\0.ply",
    "x" * 300 + ".ply",
    "",
)


@dataclass(frozen=True, kw_only=True)
class FileCase:
    """A valid file, damaged, perhaps under another format's name."""

    kind: ClassVar[str] = "files"
    allowed: ClassVar[tuple[type[BaseException], ...]] = (ValueError,)

    sample: str
    suffix: str  # "" keeps the sample's own
    damage: tuple[Damage, ...]

    def run(self) -> str:
        """Read the points, then pass the gate."""
        with tempfile.TemporaryDirectory() as folder:
            name = f"cloud.{self.sample.partition(' ')[2]}"
            path = Path(folder) / (f"cloud{self.suffix}" if self.suffix else name)
            path.write_bytes(damaged(valid(self.sample), self.damage))
            points = read_points(path)
            assert points.dtype == np.float64, points.dtype
            assert points.ndim == 2, points.shape
            assert points.shape[1] == 3, points.shape
            PointCloud.of(path, nonfinite="drop")
        return "read"


@dataclass(frozen=True, kw_only=True)
class PathCase:
    """A path with no readable file behind it."""

    kind: ClassVar[str] = "paths"
    allowed: ClassVar[tuple[type[BaseException], ...]] = (ValueError, FileNotFoundError, IsADirectoryError)

    name: str
    as_text: bool

    def run(self) -> str:
        """It must be refused."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / self.name
            if self.name.startswith("folder"):
                path.mkdir()
            elif self.name.startswith("pipe"):
                os.mkfifo(path)
            elif self.name.startswith("loop"):
                path.symlink_to(path)
            PointCloud.of(str(path) if self.as_text else path)
        raise AssertionError("a cloud came out of no file")


def cases() -> st.SearchStrategy[FileCase]:
    """Damaged files of every format."""
    return st.builds(
        FileCase,
        sample=st.sampled_from(sorted(_SAMPLES)),
        suffix=st.one_of(st.just(""), st.just(""), st.just(""), st.sampled_from(_SUFFIXES)),
        damage=damages(),
    )


def paths() -> st.SearchStrategy[PathCase]:
    """Paths to nothing."""
    return st.builds(PathCase, name=st.sampled_from(PATHS), as_text=st.booleans())


@cache
def valid(sample: str) -> bytes:
    """The content of a valid file."""
    return _SAMPLES[sample]()


def _written(name: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        write_points(Path(folder) / name, _cloud())
        return (Path(folder) / name).read_bytes()


def _cloud() -> np.ndarray:
    return np.round(sample_pair(3, 60)[0].source.points, 3)


def _ascii_ply() -> bytes:
    rows = "".join(f"{x} {y} {z} 7\n" for x, y, z in _cloud())
    faces = "element face 2\nproperty list uchar int vertex_indices\n"
    axes = "".join(f"property float {axis}\n" for axis in "xyz") + "property uchar red\n"
    header = f"ply\nformat ascii 1.0\n{faces}element vertex {len(_cloud())}\n{axes}end_header\n"
    return f"{header}3 0 1 2\n3 2 1 0\n{rows}".encode()


def _faces_first_ply() -> bytes:
    header, _, body = _written("a.ply").partition(b"end_header\n")
    faces = b"element face 2\nproperty list uchar int vertex_indices\nelement vertex"
    face = b"\x03" + np.arange(3, dtype="<i4").tobytes()
    return header.replace(b"element vertex", faces) + b"end_header\n" + face * 2 + body


def _ascii_pcd() -> bytes:
    header = _written("a.pcd").partition(b"DATA")[0]
    return header + b"DATA ascii\n" + "".join(f"{x} {y} {z}\n" for x, y, z in _cloud()).encode()


def _compressed_pcd() -> bytes:
    header = _written("a.pcd").partition(b"DATA")[0]
    raw = b"".join(column.astype("<f4").tobytes() for column in _cloud().T)
    packed = b"".join(bytes([len(raw[i : i + 32]) - 1]) + raw[i : i + 32] for i in range(0, len(raw), 32))
    sizes = np.array([len(packed), len(raw)], "<u4").tobytes()
    return header + b"DATA binary_compressed\n" + sizes + packed


def _npy() -> bytes:
    return _saved(_cloud())


def _saved(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def _npz() -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, points=_cloud(), labels=np.arange(len(_cloud())))
    return stream.getvalue()


def _rows(width: int) -> bytes:
    return np.column_stack([_cloud(), np.ones((len(_cloud()), width - 3))]).astype("<f4").tobytes()


def _text(mark: str, head: str) -> bytes:
    return (head + "".join(f"{x}{mark}{y}{mark}{z}\n" for x, y, z in _cloud())).encode()


def _las(compress: bool) -> bytes:
    try:
        import laspy
    except ImportError:
        return b"LASF"
    record = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
    record.header.scales = [1e-3] * 3
    record.x, record.y, record.z = _cloud().T
    stream = io.BytesIO()
    record.write(stream, do_compress=compress)
    return stream.getvalue()


_SAMPLES: dict[str, Callable[[], bytes]] = {
    "binary ply": lambda: _written("a.ply"),
    "ascii ply": _ascii_ply,
    "faces-first ply": _faces_first_ply,
    "binary pcd": lambda: _written("a.pcd"),
    "ascii pcd": _ascii_pcd,
    "compressed pcd": _compressed_pcd,
    "plain npy": _npy,
    "deflated npz": _npz,
    "kitti bin": lambda: _rows(4),
    "nuscenes pcd.bin": lambda: _rows(5),
    "spaces xyz": lambda: _text(" ", ""),
    "commented txt": lambda: _text("\t", "// made by hand\n"),
    "named csv": lambda: _text(",", "x,y,z\n"),
    "plain las": lambda: _las(False),
    "packed laz": lambda: _las(True),
    "empty ply": lambda: b"",
    "three-number bin": lambda: _rows(3),
    "six-number bin": lambda: _rows(6),
    "cloudcompare bin": lambda: b"CCB2" + _rows(4),
    "counted pts": lambda: f"{len(_cloud())}\n".encode() + _text(" ", ""),
    "cloudcompare asc": lambda: _text(" ", "//X Y Z\n"),
    "plain xyzn": lambda: _text(" ", ""),
    "plain xyzrgb": lambda: _text(" ", ""),
    "millimetre csv": lambda: _text(",", "X (mm), Y (mm), Z (mm)\n"),
    "unit txt": lambda: _text(" ", "# unit: cm\n"),
    "degree csv": lambda: _text(",", "lon,lat,h\n"),
    "comma txt": lambda: _text("\t", "").replace(b".", b","),
    "tabbed tsv": lambda: _text("\t", "Points:0\tPoints:1\tPoints:2\n"),
    "grid asc": lambda: b"ncols 3\nnrows 2\nxllcorner 0\n" + _text(" ", ""),
    "structured npy": lambda: _saved(np.rec.fromarrays(_cloud().T, names="z,x,y")),
    "transposed npy": lambda: _saved(_cloud().T),
    "organised npy": lambda: _saved(_cloud()[: len(_cloud()) // 20 * 20].reshape(20, -1, 3)),
    "mesh stl": lambda: b"solid",
    "table parquet": lambda: b"PAR1",
}
_SUFFIXES = (
    ".ply",
    ".PCD",
    ".npy",
    ".npz",
    ".bin",
    ".txt",
    ".csv",
    ".las",
    ".laz",
    ".jpg",
    ".pcd.bin",
    ".asc",
    ".pts",
    ".e57",
    ".tsv",
    "",
)
