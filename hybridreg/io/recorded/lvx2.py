# SPDX-License-Identifier: MIT
"""Livox Viewer 2's recordings, `.lvx2`.

Layout as Livox's description of LVX2 tells it, checked on files of our own writing only: no package reads or writes
one.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault
from hybridreg.io.recorded.recording import Recorded, Selection
from hybridreg.io.whole_files import read_whole

Array = NDArray[np.float64]
_SIGNATURE, _MAGIC = b"livox_tech", 0xAC0EA767
_PUBLIC, _PRIVATE, _DEVICE, _FRAME, _PACKAGE = 24, 5, 63, 24, 27
# Kind of a package's points: type of a coordinate, metres of its unit, bytes of a point.
_KINDS = {1: ("<i4", 0.001, 14), 2: ("<i2", 0.01, 8)}


def read_lvx2(path: Path, selection: Selection) -> Recorded:
    """Read one frame (a twentieth of a second, as a rule), or `accumulate` of them, of all devices together.

    Each device's extrinsics (degrees, metres) are applied where the file says that they count, and its place is told.

    Raises
    ------
    ValueError
        Of another version, damaged, or without the frame that was asked for.
    """
    name = str(path)
    data = read_whole(path)
    if not data.startswith(_SIGNATURE):
        raise fault(name, "does not begin as an LVX file of Livox does")
    if len(data) < _PUBLIC + _PRIVATE or data[16] != 2:
        version = data[16] if len(data) > 16 else "?"
        raise fault(name, f"is of LVX version {version}, only 2 is read", "convert it with Livox Viewer 2")
    if struct.unpack_from("<I", data, 20)[0] != _MAGIC:
        raise fault(name, "its header is damaged (the magic code is wrong)")
    devices = data[_PUBLIC + 4]
    start = _PUBLIC + _PRIVATE + _DEVICE * devices
    poses = dict(_device(data, _PUBLIC + _PRIVATE + _DEVICE * row, name) for row in range(devices))
    frames = list(_frames(data, start, name))
    first = selection.first_of(len(frames), name, "frames")
    clouds: list[Array] = []
    rows: list[Array] = []
    for begin, end in frames[first : first + selection.accumulate]:
        for lidar, points in _packages(data, begin, end, name):
            R, t = poses.get(lidar, (np.eye(3), np.zeros(3)))
            clouds.append(points @ R.T + t)
            rows.append(np.full(len(points), lidar))
    if not clouds:
        raise fault(name, f"frame {first} holds no points", "choose another index")
    seen, of_point = np.unique(np.concatenate(rows), return_inverse=True)
    places = np.array([poses.get(lidar, (np.eye(3), np.zeros(3)))[1] for lidar in seen.tolist()])
    return Recorded(np.vstack(clouds), places, of_point if len(places) > 1 else None, holed=True)


def _device(data: bytes, place: int, name: str) -> tuple[int, tuple[Array, Array]]:
    from scipy.spatial.transform import Rotation

    if place + _DEVICE > len(data):
        raise fault(name, "breaks off among its devices")
    lidar = struct.unpack_from("<I", data, place + 32)[0]
    counts = data[place + 38]
    roll, pitch, yaw, x, y, z = struct.unpack_from("<6f", data, place + 39)
    if not counts:
        return lidar, (np.eye(3), np.zeros(3))
    rotation = Rotation.from_euler("xyz", [roll, pitch, yaw], degrees=True).as_matrix()
    return lidar, (rotation, np.array([x, y, z], dtype=np.float64))


def _frames(data: bytes, place: int, name: str) -> Any:
    while place + _FRAME <= len(data):
        here, after = struct.unpack_from("<QQ", data, place)
        if here != place or (after and not place + _FRAME <= after <= len(data)):
            raise fault(name, f"its frame at byte {place} says that it lies at {here} and ends at {after}")
        yield place + _FRAME, after or len(data)
        if not after:
            return
        place = after


def _packages(data: bytes, place: int, end: int, name: str) -> Any:
    while place + _PACKAGE <= end:
        lidar = struct.unpack_from("<I", data, place + 1)[0]
        kind, length = data[place + 17], struct.unpack_from("<I", data, place + 18)[0]
        place += _PACKAGE
        if kind not in _KINDS or length % _KINDS[kind][2] or place + length > end:
            raise fault(name, f"a package at byte {place} has points of kind {kind} in {length} bytes")
        code, metres, size = _KINDS[kind]
        width = np.dtype(code).itemsize
        layout: Any = {"names": ["xyz"], "formats": [(code, 3)], "offsets": [0], "itemsize": size}
        assert 3 * width <= size
        rows = np.frombuffer(data, np.dtype(layout), length // size, place)
        yield lidar, rows["xyz"].astype(np.float64) * metres
        place += length
