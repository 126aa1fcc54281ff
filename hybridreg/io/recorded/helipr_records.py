# SPDX-License-Identifier: MIT
"""HeLiPR's own `.bin` files (Jung et al. 2023), known by the folder of their sensor: `LiDAR/Avia/<stamp>.bin`.

Layouts as the data set's player reads them; tried on files of our own writing only.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hybridreg.io.faults import fault
from hybridreg.io.record_fields import stack_axes
from hybridreg.io.recorded.recording import Recorded, Selection
from hybridreg.io.whole_files import read_whole

# Bytes of a point, x, y and z first (float32): then for Ouster intensity, t, reflectivity, ring, ambient; Velodyne
# intensity, ring, time; Avia reflectivity, tag, line, offset_time; Aeva reflectivity, velocity, time offset, line, and
# from a stamp of 2023-08-13 on intensity.
_SIZES = {"Ouster": 26, "Velodyne": 22, "Avia": 19, "Aeva": 25}
_AEVA_FROM, _AEVA_LONGER = 1691936557946849179, 29


def is_helipr(path: Path) -> bool:
    """Whether a path is that of a HeLiPR scan: a file of a stamp in nanoseconds in a folder of its sensor's name."""
    return (
        path.suffix.lower() == ".bin"
        and path.parent.name in _SIZES
        and path.stem.isdecimal()
        and len(path.stem) > 15
    )


def read_helipr(path: Path, selection: Selection) -> Recorded:
    """Read x, y and z of a HeLiPR scan, in its sensor's frame.

    Raises
    ------
    ValueError
        Its size is no multiple of a point's.
    """
    sensor, data = path.parent.name, read_whole(path)
    size = _SIZES[sensor]
    if sensor == "Aeva" and int(path.stem) > _AEVA_FROM:
        size = _AEVA_LONGER
    if not data or len(data) % size:
        cure = "copy it again; if it is no file of HeLiPR, move it out of a folder of that name"
        raise fault(
            str(path), f"its {len(data)} bytes are no multiple of {size}, a point of HeLiPR's {sensor}", cure
        )
    layout: Any = {"names": list("xyz"), "formats": ["<f4"] * 3, "offsets": [0, 4, 8], "itemsize": size}
    rows = np.frombuffer(data, np.dtype(layout))
    return Recorded(stack_axes(rows["x"], rows["y"], rows["z"]), np.zeros((1, 3)), holed=True)
