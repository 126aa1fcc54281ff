# SPDX-License-Identifier: MIT
"""E57 files, through `pye57`: every scan at its pose, and its scanner's place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import FETCH_AGAIN, fault, foreign_parser
from hybridreg.io.record_fields import stack_axes
from hybridreg.io.recorded.recording import Recorded, Selection
from hybridreg.runtime.optional_packages import load

Array = NDArray[np.float64]
_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_PAGE = 1024  # bytes, the last four of them a checksum
# 1: the direction is known and the range is not, 2: neither is (ASTM E2807).
_STATES = ("cartesianInvalidState", "sphericalInvalidState")


def read_e57(path: Path, selection: Selection) -> Recorded:
    """Read all scans in the file's frame, or those of `index` and `accumulate`; points without a range are left out.

    A scan's coordinates count from its scanner, and its pose puts them into the file's frame, so that each pose tells
    where its points were seen from. A file of one scan without a pose may be a map: its place is not told then.

    Raises
    ------
    ValueError
        Damaged, without scans or points, or without the scan that was asked for.
    ImportError
        Without pye57.
    """
    name = str(path)
    pye57 = load("pye57", f"{name}: an E57 file")
    with foreign_parser(name, "an E57 file", _cure(path)):
        file = pye57.E57(name)
    try:
        count = int(file.scan_count)
        if count == 0:
            raise fault(name, "holds no scans", "export it with its points")
        first, last = 0, count
        if selection.index is not None or selection.accumulate > 1:
            first = selection.first_of(count, name, "scans")
            last = first + selection.accumulate
        scans = [_scan(file, row, name) for row in range(first, last)]
    finally:
        file.close()
    points = np.vstack([each for each, _ in scans])
    if not len(points):
        raise fault(name, f"its {len(scans)} scans hold no point with a range", "export it with its points")
    places = np.array([place for _, place in scans if place is not None])
    if len(places) < len(scans):
        return Recorded(points)
    rows = np.repeat(np.arange(len(scans)), [len(each) for each, _ in scans])
    return Recorded(points, places, rows if len(scans) > 1 else None)


def _cure(path: Path) -> str:
    # Cut short, or written without checksums, as whitebox-workflows 2.0.6 does: no copy of that can be opened.
    size = path.stat().st_size if path.is_file() else 0
    if size % _PAGE:
        pages = f"E57 has whole pages of {_PAGE} bytes, this file {size} bytes"
        return f"{FETCH_AGAIN} ({pages}); if it was written so, export it as LAS or PLY instead"
    return FETCH_AGAIN


def _scan(file: Any, row: int, name: str) -> tuple[Array, Array | None]:
    with foreign_parser(name, "an E57 file"):
        header = file.get_header(row)
        fields = set(header.point_fields)
        raw = file.read_scan_raw(row)
        posed = bool(header.has_pose())
        quaternion = np.array(header.rotation, dtype=np.float64) if posed else np.array([1.0, 0.0, 0.0, 0.0])
        place = np.array(header.translation, dtype=np.float64) if posed else np.zeros(3)
    if fields.issuperset(_CARTESIAN):
        points = stack_axes(*(np.asarray(raw[axis]) for axis in _CARTESIAN))
    elif fields.issuperset(_SPHERICAL):
        points = _from_sphere(*(np.asarray(raw[axis], dtype=np.float64) for axis in _SPHERICAL))
    else:
        raise fault(name, f"scan {row} has the fields {', '.join(sorted(fields))[:200]}, no coordinates")
    for state in _STATES:  # absent where all points are valid
        if state in raw:
            points = (
                points[np.asarray(raw[state])[: len(points)] == 0]
                if len(raw[state]) == len(points)
                else points
            )
    return points @ _rotation(quaternion, name).T + place, place if posed else None


def _from_sphere(distance: Array, azimuth: Array, elevation: Array) -> Array:
    flat = distance * np.cos(elevation)
    return np.column_stack([flat * np.cos(azimuth), flat * np.sin(azimuth), distance * np.sin(elevation)])


def _rotation(quaternion: Array, name: str) -> Array:
    from scipy.spatial.transform import Rotation

    length = float(np.linalg.norm(quaternion))
    if not 0.5 < length < 2.0:
        problem = f"a scan's rotation is the quaternion {quaternion.tolist()}, no rotation"
        raise fault(name, problem, "export it with the poses of its scans, or without any")
    rotation: Array = Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()  # w stands last there
    return rotation
