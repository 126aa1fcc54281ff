# SPDX-License-Identifier: MIT
"""Objects that hold points, from drivers, development kits and tools: recognised by their attributes, without
imports."""

from __future__ import annotations

import inspect
import io
from collections.abc import Mapping
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from hybridreg.io import tables
from hybridreg.io.arrays import array_points, together_in
from hybridreg.io.coordinate_systems.declared_system import PROJECT, unit_declared
from hybridreg.io.coordinate_systems.geo_columns import coordinates_of, unit_of_frame, unit_of_schema
from hybridreg.io.coordinate_systems.las_extended import records_of_header
from hybridreg.io.coordinate_systems.las_units import metres_of_las, metres_of_system
from hybridreg.io.coordinate_systems.length_unit import in_metres
from hybridreg.io.formats.las_withheld import flags_withheld, without_withheld
from hybridreg.io.list_columns import listed_points, without_records
from hybridreg.io.meaning.beside_points import refuse_second_cloud, with_what_is_beside
from hybridreg.io.meaning.grids import refuse_grid
from hybridreg.io.meaning.length_units import one_unit, unit_given
from hybridreg.io.recorded import ros_messages, vtk_objects

Array = NDArray[np.float64]

# Where objects keep their points: pypcd, dev kits and laspy, Open3D and most others, torch_geometric, trimesh's clouds,
# pymeshlab, py4dgeo. MeshLab's E57 scans have their pose beside their vertices, which lie in the scanner's frame.
_HOLD = ("pc_data", "xyz", "points", "pos", "positions", "vertices", "transformed_vertex_matrix", "cloud")
# Where meshes keep their vertices, and how to ask for them: Open3D's tensors, trimesh and others, pymeshlab.
_VERTICES = {
    "vertex": 'x.vertex["positions"]',
    "vertices": "x.vertices",
    "transformed_vertex_matrix": "x.transformed_vertex_matrix()",
}
_DEEPEST = 3
_TRIANGLE = 3  # corners
_PROJECT = "project them to metres first, for example with geopandas: x.to_crs(x.estimate_utm_crs())"
_CURE = "pass an array of shape (N, 3), such as numpy.column_stack([x, y, z])"


def points_of(x: Any, name: str, depth: int = 0) -> Array:
    """Coordinates (N, 3), a copy, of whatever holds them; masked or missing values are NaN.

    Raises
    ------
    ValueError
        Nothing there holds points, or it is a mesh and not a cloud; the message says what to pass instead.
    """
    if isinstance(x, np.ndarray):
        plain = (
            np.asarray(x) if hasattr(x, "unit") else x
        )  # astropy's quantities compare with their like alone
        return in_metres(_from_array(plain, name), unit_given(x, name), name)
    if hasattr(x, "detach") and hasattr(x, "cpu"):
        return _from_torch(x, name)
    if ros_messages.is_cloud(x):
        return ros_messages.points(x, name)
    if hasattr(x, "point") and hasattr(
        x, "to_legacy"
    ):  # Open3D tensor cloud; one without points has no positions
        return _from_array(
            x.point["positions"].cpu().numpy() if "positions" in x.point else np.empty((0, 3)), name
        )
    names = tables.labels(x)
    refuse_grid(x, names, name)
    if names is not None:
        return _from_table(x, names, name, depth)
    if vtk_objects.is_vtk(x):
        return _from_vtk(x, name)
    clouds = _clouds_of_scene(x)
    if clouds is not None:
        said = one_unit((unit_given(each, name) for each in x.geometry.values()), name)
        return in_metres(_from_array(clouds, name), said, name)
    _refuse_mesh(x, name)
    if hasattr(getattr(x, "header", None), "vlrs") and hasattr(x, "xyz"):  # laspy
        points = without_withheld(_from_array(np.asarray(x.xyz), name), flags_withheld(x), name)
        return metres_of_las(points, records_of_header(x.header, name), name)
    held = _held(x)
    if held is not None and depth < _DEEPEST:
        return _held_points(held, x, name, depth)
    if all(hasattr(x, axis) for axis in "xyz"):  # laspy's records
        points = tables.points({axis: getattr(x, axis) for axis in "xyz"}, list("xyz"), name)
        points = without_withheld(points, flags_withheld(x), name)
        declared = unit_declared(x)
        return points if declared is None else metres_of_system(points, declared, name, PROJECT)
    if isinstance(x, (list, tuple)) and x and not isinstance(x[0], (list, np.ndarray, int, float)):
        rows = _named_rows(x)
        if rows is not None:
            return points_of(rows, name, depth + 1)
    entries = _entries(x)
    if entries and depth < _DEEPEST:
        return points_of(entries, name, depth + 1)
    points = with_what_is_beside(_from_array(_as_array(x, name), name), tables.attributes_beside(x), name)
    return in_metres(points, unit_given(x, name), name)


def _from_array(array: NDArray[Any], name: str, batched: bool = False) -> Array:
    if array.size == 0:
        raise ValueError(f"{name}: the cloud is empty (shape {array.shape}); it needs at least 20 points")
    return array_points(array, name, batched=batched)


def _from_torch(x: Any, name: str) -> Array:
    x = x.detach().cpu()
    x = x.to_dense() if str(getattr(x, "layout", "")).startswith("torch.sparse") else x
    # numpy has no bfloat16, and float64 holds every other float exactly.
    return _from_array(
        (x.double() if x.is_floating_point() else x.resolve_conj()).numpy(), name, batched=True
    )


def _from_table(x: Any, names: list[Any], name: str, depth: int) -> Array:
    for first in ("collect", "compute"):
        if callable(getattr(x, first, None)) and not hasattr(x, "data_vars") and not hasattr(x, "dims"):
            _refuse(x, name, f"it is not computed yet; pass what its {first}() returns")
    if "geometry" in names and hasattr(x, "get_coordinates"):
        _refuse(x, name, f"pass {coordinates_of('x', unit_of_frame(x))}")
    if depth < _DEEPEST and isinstance(x, Mapping):
        found = together_in(names) or ((names.index("arr_0"), None) if "arr_0" in names else None)
        if found is not None:
            return _entry(x, names[found[0]], found[1], name, depth)
    system = None
    if hasattr(x, "schema") and hasattr(x, "flatten"):
        system = unit_of_schema(x.schema)
        x = without_records(x, name)
        names = list(x.schema.names)
    listed = None if isinstance(x, Mapping) else listed_points(x, names, name)
    points = _from_array(listed, name) if listed is not None else tables.points(x, names, name)
    return points if system is None else metres_of_system(points, system, name, _PROJECT)


def _entry(x: Mapping[Any, Any], key: Any, metres: float | None, name: str, depth: int) -> Array:
    if metres is None:
        points = _held_points(x[key], x, name, depth)
    else:
        points = in_metres(points_of(x[key], name, depth + 1), metres, name)
    if key == "arr_0":  # numpy's archives
        unnamed = [(each, x[each]) for each in x if str(each).startswith("arr_") and each != key]
        refuse_second_cloud(points, [each for each in unnamed if isinstance(each[1], np.ndarray)], name)
    return with_what_is_beside(points, tables.beside(x, list(x)), name)


def _from_vtk(x: Any, name: str) -> Array:
    if x.IsA("vtkCompositeDataSet"):
        _refuse(x, name, "it holds several data sets; give one of them")
    if not vtk_objects.is_cloud(x):
        vertices = "x.points" if hasattr(x, "n_points") else "x.GetPoints()"  # of pyvista and of VTK
        cure = f"save its surface as .vtp and give the file, or pass its vertices, {vertices}, where they lie densely"
        _refuse(x, name, f"a surface or a grid is not a cloud; {cure}")
    points = _from_array(vtk_objects.vtk_points(x, name), name)
    return in_metres(points, unit_given(vtk_objects.words_in(x), name), name)


def _clouds_of_scene(x: Any) -> Array | None:
    # trimesh's scenes: clouds alone, each moved to its place.
    parts = getattr(x, "geometry", None)
    if not isinstance(parts, Mapping) or not parts or not callable(getattr(x, "dump", None)):
        return None
    if any(hasattr(part, "faces") or not hasattr(part, "vertices") for part in parts.values()):
        return None
    return np.vstack([np.asarray(part.vertices, dtype=np.float64) for part in x.dump()])


def _held_points(held: Any, x: Any, name: str, depth: int) -> Array:
    points = without_withheld(points_of(held, name, depth + 1), flags_withheld(x), name)
    # What lies deepest knows best, and was read in metres.
    if unit_given(held, name) or unit_declared(held) or hasattr(getattr(held, "header", None), "vlrs"):
        return points
    said, declared = unit_given(x, name), unit_declared(x)
    if said is None and declared is not None:
        return metres_of_system(points, declared, name, PROJECT)
    return in_metres(points, said, name)


def _held(x: Any) -> Any:
    if hasattr(x, "magnitude") and hasattr(x, "units"):  # pint
        return x.magnitude
    for attribute in _HOLD:
        held = getattr(x, attribute, None)
        held = held() if callable(held) else held  # small_gicp's points are a method
        if held is not None:
            return held
    if hasattr(getattr(x, "points3D", None), "values"):  # pycolmap's reconstructions
        return np.array([each.xyz for each in x.points3D.values()])
    if hasattr(x, "elements") and hasattr(x, "obj_info"):  # plyfile
        return x["vertex"].data
    data = getattr(x, "data", None)
    if isinstance(data, np.ndarray) and data.dtype.names:  # one element of it
        return data
    if hasattr(x, "__cuda_array_interface__") and hasattr(x, "get"):  # cupy
        return x.get()
    if callable(getattr(x, "cpu", None)) and callable(getattr(x, "numpy", None)):  # Open3D's own tensors
        return x.cpu().numpy()
    return None


def _entries(x: Any) -> dict[str, Any] | None:
    # zarr's groups since 3.0 and tensordict's are no mappings; what a group says of all its arrays stands in `attrs`.
    if not callable(getattr(x, "keys", None)) or not hasattr(x, "__getitem__") or hasattr(x, "dtype"):
        return None
    attributes = getattr(x, "attrs", None)
    said = dict(attributes) if isinstance(attributes, Mapping) else {}
    return {**said, **{key: x[key] for key in x.keys() if isinstance(key, str)}}  # noqa: SIM118


def _named_rows(rows: Any) -> Any:
    # Reading by position would be wrong where the rows have names.
    first = rows[0]
    if isinstance(first, Mapping):
        return {key: [row.get(key) for row in rows] for key in first}
    if isinstance(first, np.void) and first.dtype.names:
        return np.array(rows, dtype=first.dtype)
    if hasattr(first, "_fields"):
        return {key: [row[k] for row in rows] for k, key in enumerate(first._fields)}
    if all(hasattr(first, axis) for axis in "xyz"):
        told = ("x", "y", "z", *(["withheld"] if hasattr(first, "withheld") else []))  # copclib's points
        return {each: [getattr(row, each) for row in rows] for each in told}
    return None


def _refuse_mesh(x: Any, name: str) -> None:
    # An array has no unit.
    metres = unit_given(x, name)
    factor = "" if metres in (None, 1.0) else f" * {metres:.9g}"
    if hasattr(x, "geometry") and callable(getattr(x, "to_mesh", None)):
        _refuse(x, name, f"a scene is not a cloud; sample its surfaces: x.to_mesh().sample(100_000){factor}")
    if callable(getattr(x, "current_mesh", None)):  # pymeshlab's sets
        _refuse(x, name, "it holds several meshes; give one of them, x.current_mesh()")
    if not _has_faces(x):
        return
    sample = "sample_points_uniformly" if hasattr(x, "sample_points_uniformly") else "sample"
    vertices = next((words for held, words in _VERTICES.items() if hasattr(x, held)), "x.points")
    how = f"sample its surface, x.{sample}(100_000){factor}" if hasattr(x, sample) else "sample its surface"
    _refuse(
        x,
        name,
        f"a mesh is not a cloud; {how}, or pass its vertices, {vertices}{factor}, where they lie densely",
    )


def _has_faces(x: Any) -> bool:
    if callable(getattr(x, "face_number", None)):  # pymeshlab
        return bool(x.face_number())
    if any(hasattr(x, each) for each in ("triangles", "triangle", "faces")):
        faces = getattr(x, "faces", None)
        return faces is None or callable(faces) or len(faces) > 0
    cells, mesh = getattr(x, "cells", None), getattr(x, "mesh", None)
    if isinstance(cells, (list, tuple)):
        return any(map(_is_faces, cells))
    # pyntcloud, whose faces are a table beside the points
    return mesh is not None and tables.labels(mesh) is not None and len(mesh) > 0


def _is_faces(cells: Any) -> bool:
    # meshio's cells of one kind, which may be points too; vedo's are rows of corners
    if hasattr(cells, "type"):
        return bool(cells.type != "vertex" and len(cells.data))
    return len(cells) >= _TRIANGLE


def _as_array(x: Any, name: str) -> NDArray[Any]:
    if isinstance(x, (bytes, bytearray)):
        cure = "bytes have no type; of a file pass the path, of numbers numpy.frombuffer(x, dtype).reshape(-1, 3)"
        _refuse(x, name, cure)
    if isinstance(x, io.IOBase):
        _refuse(x, name, "pass the path of the file; bytes in memory must be written to one first")
    array = np.ma.asarray(x) if np.ma.isMaskedArray(x) else np.asarray(x)
    if isinstance(x, (list, tuple)) and any(np.ma.isMaskedArray(each) for each in x):
        # numpy leaves the masks out
        array = np.ma.array(array, mask=[np.ma.getmaskarray(each) for each in x])
    if array.ndim == 0 and array.dtype.kind in "OUS":
        _refuse(x, name, "pass what its read() returns" if _reads_itself(x) else _CURE)
    return array


def _reads_itself(x: Any) -> bool:
    # Not by a function of its class that takes a path, as pointcloudkit 0.1.0's clouds have.
    found = inspect.getattr_static(x, "read", None)
    return callable(getattr(x, "read", None)) and not isinstance(found, (staticmethod, classmethod))


def _refuse(x: Any, name: str, cure: str) -> NoReturn:
    raise ValueError(f"{name}: cannot read points from {type(x).__module__}.{type(x).__name__}: {cure}")
