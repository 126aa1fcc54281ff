# SPDX-License-Identifier: MIT
"""Images that come where a cloud is expected: depths, ranges, heights, photos."""

from __future__ import annotations

import warnings
from typing import Any

from numpy.typing import NDArray

from hybridreg.io.faults import fault

# A row of a table holds a point, its normal, colours, features; FPFH, the longest in use, has 33. By hand.
_MOST_COLUMNS = 40
# No image is so many times as high as wide; a table with a learned feature for each point is.
_TALLEST = 50
_SMALLEST = 8  # pixels along the shorter side of a photo
_LOOKED_AT = 100_000  # values of a photo
_UNPROJECT = (
    "unproject it to points x, y and z, for example with open3d.geometry.PointCloud.create_from_depth_image; "
    "if each row is a point, give its x, y and z alone"
)


def refuse_image(rows: int, columns: int, name: str) -> None:
    """Refuse a table that is as wide as an image.

    Raises
    ------
    ValueError
        More columns than a point has values, and not many more rows.
    """
    if is_image(rows, columns):
        raise fault(
            name, f"its {rows} x {columns} numbers are an image, not a row for each point", _UNPROJECT
        )


def is_image(rows: int, columns: int) -> bool:
    """Whether so many rows of so many numbers are a depth or range image, and no points."""
    return columns > _MOST_COLUMNS and 1 < rows < _TALLEST * columns


def check_photo(array: NDArray[Any], name: str) -> None:
    """Refuse the colours of a photo, (H, W, 3 or 4) or (3 or 4, H, W), where they are bytes; warn where they may be.

    Raises
    ------
    ValueError
        Bytes, of which no sensor makes its coordinates.
    """
    height, width = array.shape[:2] if array.shape[2] in (3, 4) else array.shape[1:]
    if min(height, width) < _SMALLEST:
        return
    if array.dtype.kind == "u" and array.dtype.itemsize == 1:
        problem = f"its {height} x {width} pixels of bytes are the colours of a photo, not points"
        raise fault(name, problem, "give the points that belong to it")
    some = array.reshape(-1)[:: max(1, array.size // _LOOKED_AT)]
    # A sensor has points on both sides of it; colours are whole numbers from 0 on, or go from 0 to 1.
    if array.dtype.kind == "u" or (some.min() >= 0.0 and 0.0 < some.max() <= 1.0):
        warnings.warn(
            f"{name}: its {height} x {width} values are those of a photo, and were read as points; if it is one, give "
            "the points that belong to it",
            UserWarning,
            stacklevel=3,
        )
