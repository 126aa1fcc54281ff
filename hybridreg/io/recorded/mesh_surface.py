# SPDX-License-Identifier: MIT
"""Meshes and clouds of design tools, through `trimesh`: a surface becomes points spread evenly over it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, foreign_parser
from hybridreg.io.meaning.unit_comments import as_commented
from hybridreg.io.recorded.gltf_positions import check_positions
from hybridreg.io.recorded.recording import Recorded, Selection
from hybridreg.runtime.optional_packages import load

Array = NDArray[np.float64]

# Points of a mesh: some hundreds on each of the cells that a default voxel leaves of it.
_SAMPLES = 200_000
_LOOKED_AT = 2_000  # faces whose corners are passed on
_VERTEX = re.compile(rb"^v[ \t]", re.MULTILINE)
_HEAD, _STL = 16_384, 80  # bytes looked at for comments, and those of a binary STL's title
NO_PLACE = np.zeros((0, 3))


def read_mesh(path: Path, selection: Selection) -> Recorded:
    """Read a `.obj`, `.stl`, `.off`, `.glb` or `.gltf` file, in its own frame; in metres where a comment or the title
    of an STL gives another unit, as those of 3ds Max and SketchUp do.

    A mesh gives 200,000 points drawn evenly over its area, always the same; a file without faces its own points. A mesh
    was seen by nobody, so that free space is not tested. glTF's y axis points up: say `gravity=` if you compare it
    with a scan whose z does.

    Raises
    ------
    ValueError
        Damaged, empty, with faces that are not finite or have no area, or as `check_positions` and
        `refuse_loose`.
    ImportError
        Without trimesh.
    """
    name = str(path)
    trimesh = load("trimesh", f"{name}: a mesh")
    if path.suffix.lower() in (".glb", ".gltf"):
        check_positions(path, name)
    with foreign_parser(name, "a mesh"):
        loaded = trimesh.load(name, process=False)
        parts = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
        meshes = [part for part in parts if len(getattr(part, "faces", ()))]
        clouds = [len(part.vertices) for part in parts if isinstance(part, trimesh.PointCloud)]
        used = [corners(np.asarray(mesh.faces), len(mesh.vertices)) for mesh in meshes]
        held = [len(mesh.vertices) for mesh in meshes]
        if meshes:
            triangles = np.vstack([np.asarray(mesh.triangles, dtype=np.float64) for mesh in meshes])
        points = [np.asarray(part.vertices, dtype=np.float64) for part in parts if len(part.vertices)]
    if meshes:
        every = max(sum(held), _vertices_of_obj(path))
        refuse_loose(sum(clouds) or every - sum(used), 0 if clouds else every, name)
        some = triangles[:: max(1, len(triangles) // _LOOKED_AT)].reshape(-1, 3)
        # Together, so that a unit counts for both and is told once.
        both = as_commented(np.vstack([spread_over(triangles, name), some]), _comments(path), name)
        return Recorded(both[:_SAMPLES], NO_PLACE, corners=both[_SAMPLES:])
    if not points:
        raise fault(name, "holds neither faces nor points", "export it with its geometry")
    return Recorded(as_commented(np.vstack(points), _comments(path), name))


def _comments(path: Path) -> list[str]:
    suffix = path.suffix.lower()
    if suffix not in (".obj", ".off", ".stl"):
        return []
    with open(path, "rb") as file:
        head = file.read(_HEAD).decode("latin-1")
    if suffix == ".stl":
        return [(head.splitlines()[0] if head.startswith("solid") else head[:_STL]).strip("\0 ")]
    return [line.strip("# \t") for line in head.splitlines() if line.startswith("#")]


def refuse_loose(loose: int, every: int, name: str) -> None:
    """Refuse `loose` points that belong to no face, where they are more than half of `every` one: a scan that is saved
    with a marker or a model beside it would be left out.

    Raises
    ------
    ValueError
        There are so many.
    """
    if 2 * loose > every:
        problem = f"holds surfaces and {loose} points that belong to none"
        raise fault(name, problem, "export only the points, or only the surfaces")


def corners(faces: NDArray[np.int64], count: int) -> int:
    """How many of `count` vertices are corners of faces."""
    used = np.zeros(count, dtype=bool)
    used[np.ravel(faces)] = True
    return int(used.sum())


def _vertices_of_obj(path: Path) -> int:
    # Those of no face are left out by trimesh.
    return len(_VERTEX.findall(path.read_bytes())) if path.suffix.lower() == ".obj" else 0


def spread_over(triangles: Array, name: str) -> Array:
    """Points (200,000, 3) drawn evenly over the area of triangles (n, 3, 3), always the same.

    Raises
    ------
    ValueError
        A corner that is not finite, or no area.
    """
    bad = int((~np.isfinite(triangles).all(axis=(1, 2))).sum())
    if bad:
        raise fault(
            name, f"{bad} of {len(triangles)} faces have corners that are not finite", "repair the mesh"
        )
    along, across = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    area = np.linalg.norm(np.cross(along, across), axis=1)
    if not area.sum() > 0.0:
        raise fault(
            name, f"its {len(triangles)} faces have no area", "export the points, or a proper surface"
        )
    rng = np.random.default_rng(0)
    rows = rng.choice(len(triangles), _SAMPLES, p=area / area.sum())
    u, v = rng.random((2, _SAMPLES, 1))
    over = u + v > 1.0  # the other half of the parallelogram, folded back
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    points: Array = triangles[rows, 0] + u * along[rows] + v * across[rows]
    return points
