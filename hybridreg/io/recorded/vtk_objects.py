# SPDX-License-Identifier: MIT
"""Objects of VTK itself: the points of a vtkPolyData or of vtkPoints."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.runtime.optional_packages import load

Array = NDArray[np.float64]


def is_vtk(x: Any) -> bool:
    """Whether an object is a data set with points of VTK, or the points alone; those of pyvista are read as arrays."""
    is_a = getattr(x, "IsA", None)
    return callable(is_a) and not hasattr(x, "n_cells") and bool(is_a("vtkPointSet") or is_a("vtkPoints"))


def is_cloud(x: Any) -> bool:
    """Whether it is points without faces: a surface, a grid or a volume is none."""
    if x.IsA("vtkPoints"):
        return True
    return bool(x.IsA("vtkPolyData")) and not (x.GetNumberOfPolys() or x.GetNumberOfStrips())


def vtk_points(x: Any, name: str) -> Array:
    """The points (N, 3) of a data set or of vtkPoints, a copy; N may be 0."""
    convert = load("vtkmodules.util.numpy_support", f"{name}: an object of VTK").vtk_to_numpy
    held = x if x.IsA("vtkPoints") else x.GetPoints()
    if held is None or not held.GetNumberOfPoints():
        return np.empty((0, 3))
    return np.array(convert(held.GetData()), dtype=np.float64)
