# SPDX-License-Identifier: MIT
"""Tables of which one column holds x, y and z of each point as a list: pandas, polars, pyarrow and Parquet."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.arrays import together_in
from hybridreg.io.coordinate_systems.geo_columns import coordinates_of, unit_of_schema
from hybridreg.io.coordinate_systems.length_unit import LengthUnit, in_metres
from hybridreg.io.faults import fault, shorten

Array = NDArray[np.float64]

_MOST = 6  # numbers a point: x, y, z and what sensors add


def listed_points(x: Any, names: list[Any], name: str) -> Array | None:
    """The lists of a column that is called `xyz` or alike, (N, 3 to 6), or those of three numbers of the only column; a
    missing one is NaN. None where there is no such column of lists.

    Raises
    ------
    ValueError
        Lists of unequal length, or of something else than numbers.
    """
    found = together_in(names)
    together = None if found is None else found[0]
    if {"x", "y", "z"} & {str(each).lower() for each in names} or (together is None and len(names) != 1):
        return None
    label = names[together or 0]
    column = x.column(label) if hasattr(x, "column") and hasattr(x, "schema") else x[label]
    if not hasattr(column, "to_numpy") or str(getattr(column, "dtype", "")).startswith("Struct"):
        return None  # records, whose names an array would lose
    values = column.to_numpy()
    listed = values if values.ndim == 2 else _stacked(values, label, name)
    # A lone column of another name may hold anything: a quaternion, an image.
    most = _MOST if together is not None else 3
    if listed is None or not 3 <= listed.shape[1] <= most:
        return None
    return listed if found is None or found[1] is None else in_metres(listed[:, :3], found[1], name)


def without_records(x: Any, name: str) -> Any:
    """A table of pyarrow whose columns of records, such as a point's x, y and z, are columns of their own.

    Raises
    ------
    ValueError
        Its points are geometries in binary (WKB), as GeoParquet has them.
    """
    kinds = {field.name: str(field.type) for field in x.schema}
    if {"x", "y", "z"} <= {each.lower() for each in kinds}:
        return x
    told = (x.schema.metadata or {}).get(b"geo")
    if told is not None and "binary" in kinds.values() and b'"WKB"' in told:
        give = coordinates_of("x", unit_of_schema(x.schema) or LengthUnit())
        how = "read_feather" if name.lower().endswith((".feather", ".arrow")) else "read_parquet"
        raise fault(
            name,
            "its points are geometries in binary (WKB)",
            f"give {give} of x = geopandas.{how}(path)",
        )
    return x.flatten() if any(kind.startswith("struct") for kind in kinds.values()) else x


def refuse_clouds_in_rows(value: Any, label: Any, name: str) -> None:
    """Refuse a column that holds a list of points, or of coordinates, in each row, by the first of them.

    Raises
    ------
    ValueError
        It does; it says how to take the cloud of one row.
    """
    if isinstance(value, (list, tuple, np.ndarray)) and np.ndim(value) and len(value) > _MOST:
        nested = isinstance(value[0], (list, tuple, np.ndarray))
        cure = (
            f"numpy.stack(x[{str(label)!r}][0])"
            if nested
            else "{axis: numpy.array(x[axis][0]) for axis in 'xyz'}"
        )
        problem = (
            f"column {shorten(label)} holds {len(value)} {'points' if nested else 'numbers'} in its first row"
        )
        raise fault(name, problem, f"give the cloud of one row; where x is the table in pandas: {cure}")


def _stacked(values: NDArray[Any], label: Any, name: str) -> Array | None:
    rows = [each for each in values if isinstance(each, (list, tuple, np.ndarray))]
    lengths = sorted({len(each) for each in rows})
    if not rows:
        return None
    refuse_clouds_in_rows(rows[0], label, name)
    if len(lengths) > 1:
        problem = f"the lists of its column {shorten(label)} hold from {lengths[0]} to {lengths[-1]} numbers"
        raise fault(name, problem, "give three numbers a point")
    missing = np.full(lengths[0], np.nan)
    try:
        return np.array(
            [each if isinstance(each, (list, tuple, np.ndarray)) else missing for each in values], np.float64
        )
    except (TypeError, ValueError) as error:
        problem = f"column {shorten(label)} holds something else than numbers ({shorten(error)})"
        raise fault(name, problem, "convert it to float") from error
