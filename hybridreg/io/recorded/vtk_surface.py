# SPDX-License-Identifier: MIT
"""ParaView's `.vtp` files, through `vtk`: points as they are, a surface as points spread evenly over it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.coordinate_systems.length_unit import in_metres
from hybridreg.io.faults import fault, foreign_parser, shorten
from hybridreg.io.meaning.length_units import unit_given
from hybridreg.io.recorded import vtk_objects
from hybridreg.io.recorded.mesh_surface import NO_PLACE, corners, refuse_loose, spread_over
from hybridreg.io.recorded.recording import Recorded, Selection
from hybridreg.runtime.optional_packages import load

Array = NDArray[np.float64]


def read_vtp(path: Path, selection: Selection) -> Recorded:
    """Read a `.vtp` file, all its pieces, in its own frame, in whatever way its numbers are stored; in metres where
    its field data name another unit (`units`, a text).

    Polygons and strips of triangles are a surface, which becomes points as any mesh's does (`read_mesh`); points that
    belong to none of them are left out then, or refused where they are the most (`refuse_loose`). A file without faces
    gives all its points, those that no cell uses too.

    Raises
    ------
    ValueError
        Damaged, of another kind of data than vtkPolyData, without points, or with a face that names a point which the
        file does not have.
    ImportError
        Without vtk.
    """
    name = str(path)
    data = _poly_data(name)
    if not data.GetNumberOfPoints():
        raise fault(name, "holds no points", "save the points or the surface, not the fields alone")
    convert = load("vtkmodules.util.numpy_support", f"{name}: a file of VTK").vtk_to_numpy
    points = np.array(convert(data.GetPoints().GetData()), dtype=np.float64).reshape(-1, 3)
    points = in_metres(points, unit_given(vtk_objects.words_in(data), name), name)
    triangles = _triangles(data, points, convert, name)
    if not len(triangles):
        return Recorded(points)
    refuse_loose(len(points) - corners(triangles, len(points)), len(points), name)
    return Recorded(spread_over(points[triangles], name), NO_PLACE, corners=points)


def _poly_data(name: str) -> Any:
    core = load("vtkmodules.vtkCommonCore", f"{name}: a file of VTK")
    reader = load("vtkmodules.vtkIOXML", f"{name}: a file of VTK").vtkXMLPolyDataReader()
    reader.SetFileName(name)
    with foreign_parser(name, "a file of VTK"), _heard(core) as heard:
        reader.Update()
    told = " ".join(heard.GetOutput().split())
    if told or reader.GetErrorCode():
        why = shorten(told.partition("): ")[2] or told or f"error {reader.GetErrorCode()}", 200)
        raise fault(name, f"cannot be read as a file of VTK ({why})")
    return reader.GetOutput()


@contextmanager
def _heard(core: Any) -> Iterator[Any]:
    """What VTK says within the block, as text, instead of on the screen: of what it cannot read it gives back less."""
    window, loudness = core.vtkOutputWindow.GetInstance(), core.vtkLogger.GetCurrentVerbosityCutoff()
    heard = core.vtkStringOutputWindow()
    core.vtkOutputWindow.SetInstance(heard)
    core.vtkLogger.SetStderrVerbosity(core.vtkLogger.VERBOSITY_OFF)
    try:
        yield heard
    finally:
        core.vtkOutputWindow.SetInstance(window)
        core.vtkLogger.SetStderrVerbosity(loudness)


def _triangles(data: Any, points: Array, convert: Any, name: str) -> NDArray[np.int64]:
    """Rows of the corners, (n, 3); polygons of more corners are cut up, as are strips."""
    for cells in (data.GetPolys(), data.GetStrips()):
        rows = np.asarray(convert(cells.GetConnectivityArray()))
        if rows.size and not 0 <= rows.min() <= rows.max() < len(points):
            problem = f"a face names point {int(rows.max())}, there are {len(points)}"
            raise fault(name, problem)
    if not data.GetNumberOfPolys() + data.GetNumberOfStrips():
        return np.zeros((0, 3), dtype=np.int64)
    cut = load("vtkmodules.vtkFiltersCore", f"{name}: a file of VTK").vtkTriangleFilter()
    cut.SetInputData(data)
    cut.PassVertsOff()
    cut.PassLinesOff()
    cut.Update()
    return np.array(convert(cut.GetOutput().GetPolys().GetConnectivityArray()), dtype=np.int64).reshape(-1, 3)
