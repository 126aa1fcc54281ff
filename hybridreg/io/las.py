# SPDX-License-Identifier: MIT
"""LAS and LAZ files through laspy."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, foreign_parser
from hybridreg.io.records import stack_axes

_CHUNK = 1_000_000  # points; so that memory grows with what is there, not with what the header promises


def parse_las(data: bytes, name: str) -> NDArray[np.float64]:
    """Read x, y and z of a LAS or LAZ file, scaled and offset as its header says; shape (N, 3)."""
    laspy = _laspy()
    with foreign_parser(name, "a LAS or LAZ file"), laspy.open(io.BytesIO(data)) as reader:
        promised = int(reader.header.point_count)
        chunks = [stack_axes(*_axes(chunk)) for chunk in reader.chunk_iterator(_CHUNK)]
    points = np.concatenate(chunks) if chunks else np.empty((0, 3))
    if len(points) != promised:
        raise fault(name, f"its header promises {promised} points, it holds {len(points)}")
    return points


def _axes(chunk: Any) -> tuple[NDArray[np.float64], ...]:
    return tuple(np.asarray(axis) for axis in (chunk.x, chunk.y, chunk.z))


def _laspy() -> Any:
    try:
        import laspy
    except ImportError as error:
        raise ImportError(f"LAS files need laspy, run `pip install 'hybridreg[las]'` ({error})") from error
    return laspy
