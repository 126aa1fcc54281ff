# SPDX-License-Identifier: MIT
"""Objects of VTK and of pyvista: the points of a data set, or of vtkPoints."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.runtime.optional_packages import load

Array = NDArray[np.float64]
_VOLUME = 3  # dimensions


def is_vtk(x: Any) -> bool:
    """Whether an object is a data set of VTK, several of them, or points alone; pyvista's are too."""
    is_a = getattr(x, "IsA", None)
    return callable(is_a) and any(map(is_a, ("vtkDataSet", "vtkCompositeDataSet", "vtkPoints")))


def is_cloud(x: Any) -> bool:
    """Whether it is points without faces, or rows of points as a scanner gives them: a surface, a grid with spaces
    between or a volume is none."""
    if x.IsA("vtkPoints"):
        return True
    if x.IsA("vtkPolyData"):
        return not (x.GetNumberOfPolys() or x.GetNumberOfStrips())
    if x.IsA("vtkStructuredGrid"):
        return bool(x.GetDataDimension() < _VOLUME)
    return bool(x.IsA("vtkPointSet")) and all(
        x.GetCell(k).GetCellDimension() == 0 for k in _first_of_each_type(x)
    )


def _first_of_each_type(x: Any) -> list[int]:
    kinds = [x.GetCellType(k) for k in range(x.GetNumberOfCells())]
    return [kinds.index(kind) for kind in set(kinds)]


def vtk_points(x: Any, name: str) -> Array:
    """The points (N, 3) of a data set or of vtkPoints, a copy; N may be 0."""
    convert = load("vtkmodules.util.numpy_support", f"{name}: an object of VTK").vtk_to_numpy
    held = x if x.IsA("vtkPoints") else x.GetPoints()
    if held is None or not held.GetNumberOfPoints():
        return np.empty((0, 3))
    return np.array(convert(held.GetData()), dtype=np.float64)


def words_in(x: Any) -> dict[str, str]:
    """The field data of a data set that are one text each, as pyvista's `field_data` holds them, by their names in
    lower case."""
    held = x.GetFieldData() if x.IsA("vtkDataSet") else None
    arrays = [held.GetAbstractArray(k) for k in range(held.GetNumberOfArrays())] if held is not None else []
    return {
        str(each.GetName()).lower(): str(each.GetValue(0))
        for each in arrays
        if each.IsA("vtkStringArray") and each.GetNumberOfValues() == 1
    }
