# SPDX-License-Identifier: MIT
"""Clouds, and small valid files of every format, written without the code under test."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

try:
    import laspy
except ImportError:
    laspy = None


def literal_lzf(data: bytes) -> bytes:
    """LZF that compresses nothing: literal runs of up to 32 bytes."""
    runs = [data[start : start + 32] for start in range(0, len(data), 32)]
    return b"".join(bytes([len(run) - 1]) + run for run in runs)


@pytest.fixture(scope="session")
def cloud() -> np.ndarray:
    """Forty points that float32 holds exactly, so that every format must give them back bit for bit."""
    rng = np.random.default_rng(7)
    return rng.integers(-40000, 40000, size=(40, 3)) / 512.0


@pytest.fixture(scope="session")
def utm_cloud() -> np.ndarray:
    """Map-grid coordinates with tenths of a millimetre, which float32 cannot hold."""
    rng = np.random.default_rng(8)
    return np.array([500_000.0, 5_400_000.0, 300.0]) + np.round(rng.uniform(-50, 50, size=(40, 3)), 4)


def _ply(cloud: np.ndarray) -> dict[str, bytes]:
    faces = "element face 2\nproperty list uchar int vertex_indices\n"
    axes = "property float x\nproperty float y\nproperty double z\nproperty uchar red\n"
    row = np.dtype([("x", "f4"), ("y", "f4"), ("z", "f8"), ("red", "u1")])
    files = {}
    for order, word in (("<", "binary_little_endian"), (">", "binary_big_endian")):
        header = f"ply\nformat {word} 1.0\nelement vertex {len(cloud)}\n{axes}{faces}end_header\n"
        rows = np.zeros(len(cloud), row.newbyteorder(order))
        rows["x"], rows["y"], rows["z"] = cloud.T
        face = b"\x03" + np.array([0, 1, 2], order + "i4").tobytes()
        files[f"{word}.ply"] = header.encode() + rows.tobytes() + face * 2
    # With a list before the vertices, so that the slow path is damaged too.
    header = f"ply\nformat binary_little_endian 1.0\n{faces}element vertex {len(cloud)}\n{axes}end_header\n"
    rows = rows.astype(row.newbyteorder("<"))
    face = b"\x03" + np.array([0, 1, 2], "<i4").tobytes()
    files["faces_first.ply"] = header.encode() + face * 2 + rows.tobytes()
    header = f"ply\nformat ascii 1.0\nelement vertex {len(cloud)}\n{axes}{faces}end_header\n"
    lines = "".join(f"{x!r} {y!r} {z!r} 9\n" for x, y, z in cloud.tolist())
    files["ascii.ply"] = (header + lines + "3 0 1 2\n3 2 1 0\n").encode()
    return files


def _pcd(cloud: np.ndarray) -> dict[str, bytes]:
    n = len(cloud)
    header = f"# .PCD v0.7\nVERSION 0.7\nFIELDS i x y z _\nSIZE 2 4 4 8 1\nTYPE U F F F U\nCOUNT 1 1 1 1 4\n\
WIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA "
    rows = np.zeros(n, [("i", "<u2"), ("x", "<f4"), ("y", "<f4"), ("z", "<f8"), ("pad", "<u1", 4)])
    rows["x"], rows["y"], rows["z"] = cloud.T
    raw = b"".join(rows[field].tobytes() for field in rows.dtype.names)
    packed = literal_lzf(raw)
    sizes = np.array([len(packed), len(raw)], "<u4").tobytes()
    lines = "".join(f"7 {x!r} {y!r} {z!r} 0 0 0 0\n" for x, y, z in cloud.tolist())
    return {
        "ascii.pcd": f"{header}ascii\n{lines}".encode(),
        "binary.pcd": f"{header}binary\n".encode() + rows.tobytes(),
        "compressed.pcd": f"{header}binary_compressed\n".encode() + sizes + packed,
    }


def _numpy(cloud: np.ndarray) -> dict[str, bytes]:
    files = {}
    for name, array in {
        "plain.npy": cloud,
        "fortran.npy": np.asfortranarray(cloud.astype(np.float32)),
        "fields.npy": np.rec.fromarrays(cloud.T, names="x,y,z"),
    }.items():
        stream = io.BytesIO()
        np.save(stream, array)
        files[name] = stream.getvalue()
    for name, save in {"plain.npz": np.savez, "deflated.npz": np.savez_compressed}.items():
        stream = io.BytesIO()
        save(stream, xyz=cloud, intensity=cloud[:, 0])
        files[name] = stream.getvalue()
    stream = io.BytesIO()
    np.savez(stream, only=cloud, label=np.arange(len(cloud)))
    files["unnamed.npz"] = stream.getvalue()
    return files


def _text(cloud: np.ndarray) -> dict[str, bytes]:
    rows = cloud.tolist()
    return {
        "plain.xyz": "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in rows).encode(),
        "commented.txt": (
            "// made by hand\n" + "".join(f"{x!r}\t{y!r}\t{z!r}\n" for x, y, z in rows)
        ).encode(),
        "named.csv": ("id,z,x,y\n" + "".join(f"a,{z!r},{x!r},{y!r}\n" for x, y, z in rows)).encode(),
    }


def _bin(cloud: np.ndarray) -> dict[str, bytes]:
    ring = (np.arange(len(cloud)) % 32)[:, None]
    four = np.hstack([cloud, np.full((len(cloud), 1), 0.25)]).astype("<f4")
    five = np.hstack([cloud, np.full((len(cloud), 1), 12.0), ring]).astype("<f4")
    return {"kitti.bin": four.tobytes(), "nuscenes.pcd.bin": five.tobytes()}


def _las(cloud: np.ndarray) -> dict[str, bytes]:
    if laspy is None:
        return {}
    files = {}
    for name, compress in {"plain.las": False, "packed.laz": True}.items():
        header = laspy.LasHeader(point_format=3, version="1.2")
        header.scales = [1 / 512] * 3
        record = laspy.LasData(header)
        record.x, record.y, record.z = cloud.T
        stream = io.BytesIO()
        record.write(stream, do_compress=compress)
        files[name] = stream.getvalue()
    return files


@pytest.fixture(scope="session")
def samples(cloud: np.ndarray) -> dict[str, bytes]:
    """File name to content, each holding `cloud`."""
    return {**_ply(cloud), **_pcd(cloud), **_numpy(cloud), **_text(cloud), **_bin(cloud), **_las(cloud)}


@pytest.fixture(scope="session")
def real_data() -> Path:
    import os

    folder = Path(
        os.environ.get("HYBRIDREG_DATA", Path(__file__).parents[2] / ".." / "shared" / "data" / "real")
    )
    if not folder.is_dir():
        pytest.skip(f"no real data at {folder}")
    return folder
