# SPDX-License-Identifier: MIT
"""Meshes and clouds of design tools, through `trimesh`: a surface becomes points spread evenly over it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hybridreg.io.faults import fault, foreign_parser
from hybridreg.io.recorded.recording import Recorded, Selection
from hybridreg.runtime.optional_packages import load

# Points of a mesh: some hundreds on each of the cells that a default voxel leaves of it.
_SAMPLES = 200_000
NO_PLACE = np.zeros((0, 3))


def read_mesh(path: Path, selection: Selection) -> Recorded:
    """Read a `.obj`, `.stl`, `.off`, `.glb` or `.gltf` file, in its own frame and unit.

    A mesh gives 200,000 points drawn evenly over its area, always the same; a file without faces its own points. A mesh
    was seen by nobody, so that free space is not tested. glTF's y axis points up: say `gravity=` if you compare it
    with a scan whose z does.

    Raises
    ------
    ValueError
        Damaged, or empty.
    ImportError
        Without trimesh.
    """
    name = str(path)
    trimesh = load("trimesh", f"{name}: a mesh")
    with foreign_parser(name, "a mesh"):
        loaded = trimesh.load(name, process=False)
        parts = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
        meshes = [part for part in parts if len(getattr(part, "faces", ()))]
        if meshes:
            return Recorded(_spread(trimesh, meshes), NO_PLACE)
        points = [np.asarray(part.vertices, dtype=np.float64) for part in parts if len(part.vertices)]
    if not points:
        raise fault(name, "holds neither faces nor points", "export it with its geometry")
    return Recorded(np.vstack(points))


def _spread(trimesh: Any, meshes: list[Any]) -> Any:
    mesh = trimesh.util.concatenate(meshes)
    return np.asarray(trimesh.sample.sample_surface(mesh, _SAMPLES, seed=0)[0], dtype=np.float64)
