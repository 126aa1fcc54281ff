# SPDX-License-Identifier: MIT
"""LAS and LAZ files through laspy."""

from __future__ import annotations

import io
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.coordinate_systems.las_extended import extended_records
from hybridreg.io.coordinate_systems.las_units import metres_of_las
from hybridreg.io.faults import fault, foreign_parser
from hybridreg.io.formats.las_header import check_las_header
from hybridreg.io.formats.las_withheld import without_withheld
from hybridreg.io.record_fields import stack_axes
from hybridreg.runtime.optional_packages import load

_CHUNK = 64 * 2**20  # bytes, so that memory grows with what a LAZ file holds, not with what it claims


def parse_las(data: bytes, name: str) -> NDArray[np.float64]:
    """Read x, y and z of a LAS or LAZ file, scaled and offset as its header says; shape (N, 3), metres.

    Where the coordinate reference system says so, feet are converted with a warning and degrees refused. Points that
    are flagged as withheld are left out, with a warning.
    """
    laspy = _laspy()
    promise = check_las_header(data, name)
    chunk_points = max(_CHUNK // promise.point_size, 1)
    with foreign_parser(name, "a LAS or LAZ file"):
        # One thread: lazrs' parallel reader allocates whatever a damaged chunk table says, and crashes.
        backends = [laspy.LazBackend.Lazrs, laspy.LazBackend.Laszip]
        with laspy.open(io.BytesIO(data), laz_backend=backends, read_evlrs=False) as reader:
            records = list(reader.header.vlrs)
            chunks = [
                (stack_axes(*_axes(chunk)), np.asarray(chunk.withheld, dtype=bool))
                for chunk in reader.chunk_iterator(chunk_points)
            ]
        points = np.concatenate([axes for axes, _ in chunks]) if chunks else np.empty((0, 3))
        withheld = np.concatenate([flags for _, flags in chunks]) if chunks else np.empty(0, dtype=bool)
    if len(points) != promise.points:
        raise fault(name, f"its header promises {promise.points} points, it holds {len(points)}")
    points = without_withheld(points, withheld, name)
    return metres_of_las(points, chain(records, extended_records(data, name)), name)


def _axes(chunk: Any) -> tuple[NDArray[np.float64], ...]:
    return tuple(np.asarray(axis) for axis in (chunk.x, chunk.y, chunk.z))


def _laspy() -> Any:
    return load("laspy", "a LAS file")
