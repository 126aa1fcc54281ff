# SPDX-License-Identifier: MIT
"""Grids of xarray, such as heights over x and y: refused with the rows of points that they stand for."""

from __future__ import annotations

from typing import Any

import numpy as np

# What NetCDF and GeoTIFF keep beside numbers that are packed, and what numbers unpacked have there.
_PACKED = {"scale_factor": 1.0, "add_offset": 0.0}
_FILLS = ("_FillValue", "missing_value")


def refuse_grid(x: Any, names: list[Any] | None, name: str) -> None:
    """Refuse values over the dimensions x and y, which are their coordinates.

    Raises
    ------
    ValueError
        It is such a grid; it says how to make points of it.
    """
    flat = {str(each).lower() for each in getattr(x, "dims", ())}
    if (
        not {"x", "y"} <= flat
        or not hasattr(x, "to_dataframe")
        or {"x", "y", "z"} <= {*map(str, getattr(x, "data_vars", names) or ())}
    ):
        return
    kind = f"{type(x).__module__}.{type(x).__name__}"
    raise ValueError(
        f"{name}: cannot read points from {kind}: it is a grid over x and y, not points; if it holds heights: "
        f"{rows_of(x, 'z')}"
    )


def rows_of(x: Any, value: str) -> str:
    """The call that makes a table of a grid `x` of xarray, whose values, where they have no name, it calls `value`.

    A table has no attributes: numbers that are still packed are unpacked before.
    """
    table = hasattr(x, "data_vars")
    held = [x[each] for each in x.data_vars] if table else [x]
    if any(_is_packed(getattr(each, "attrs", {})) for each in held):
        whole = "x" if table else f'x.to_dataset(name="{value}")'
        return f"xarray.decode_cf({whole}).to_dataframe().reset_index()"
    return f"x.to_dataframe({'' if table else repr(value)}).reset_index()".replace("'", '"')


def _is_packed(attributes: Any) -> bool:
    fills = [attributes[each] for each in _FILLS if each in attributes]
    return any(attributes.get(key, plain) != plain for key, plain in _PACKED.items()) or any(
        np.isfinite(each).all() for each in fills if np.asarray(each).dtype.kind in "iuf"
    )
