# SPDX-License-Identifier: MIT
"""Ray casting by Embree: the `embreex` wheel where it is installed, else open3d."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .mesh import Mesh


@dataclass(frozen=True)
class Hits:
    """First surface along each ray: distance (n,) metres, inf where there is none; unit normal (n,3) towards
    the ray's start; material (n,) and tint (n,3) of the face."""

    distance: NDArray[np.float32]
    normal: NDArray[np.float32]
    material: NDArray[np.uint8]
    tint: NDArray[np.float32]


class Caster(Protocol):
    """Nearest triangle along rays."""

    def cast(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance (n,) float32 (inf where none) and face index (n,) of each ray's first triangle."""


class EmbreexCaster:
    """Embree through the embreex wheel (10 MB, no other dependency)."""

    def __init__(self, mesh: Mesh) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene = EmbreeScene()
        TriangleMesh(self._scene, np.ascontiguousarray(mesh.vertices), np.ascontiguousarray(mesh.faces))

    def cast(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Caster.cast`."""
        found = self._scene.run(
            np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32), output=1
        )
        face = found["primID"]
        return np.where(face >= 0, found["tfar"], np.float32(np.inf)), face


class Open3dCaster:
    """Embree as open3d carries it."""

    def __init__(self, mesh: Mesh) -> None:
        from hybridreg._open3d import load_open3d

        self._core = load_open3d().core
        self._scene = load_open3d().t.geometry.RaycastingScene(nthreads=1)
        self._scene.add_triangles(self._core.Tensor(mesh.vertices), self._core.Tensor(mesh.faces.astype(np.uint32)))

    def cast(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Caster.cast`."""
        rays = np.concatenate([np.asarray(origins, np.float32), np.asarray(directions, np.float32)], axis=1)
        found = self._scene.cast_rays(self._core.Tensor(np.ascontiguousarray(rays)))
        face = found["primitive_ids"].numpy().astype(np.int64)
        return found["t_hit"].numpy(), np.where(face == self._scene.INVALID_ID, -1, face)


def make_caster(mesh: Mesh) -> Caster:
    """The first caster that this machine has.

    Raises
    ------
    ImportError
        Where neither `embreex` nor `open3d` can be loaded.
    """
    try:
        return EmbreexCaster(mesh)
    except ImportError:
        pass
    try:
        return Open3dCaster(mesh)
    except ImportError as error:
        raise ImportError(f"the simulator needs Embree, run `pip install embreex` ({error})") from error


class World:
    """Still and moving geometry as it stands at one moment, ready for rays."""

    def __init__(self, parts: list[tuple[Mesh, Caster]]) -> None:
        self._parts = parts

    def cast(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """First hits of rays from `origins` (n,3) or (3,) along unit `directions` (n,3)."""
        origins = np.broadcast_to(np.asarray(origins, np.float32), directions.shape)
        n = len(directions)
        distance = np.full(n, np.inf, np.float32)
        normal = np.zeros((n, 3), np.float32)
        material = np.zeros(n, np.uint8)
        tint = np.zeros((n, 3), np.float32)
        for mesh, caster in self._parts:
            t, face = caster.cast(origins, directions)
            nearer = t < distance
            face = face[nearer]
            distance[nearer] = t[nearer]
            normal[nearer] = _normals(mesh, face, directions[nearer])
            material[nearer] = mesh.material[face]
            tint[nearer] = mesh.tint[face]
        return Hits(distance, normal, material, tint)

    def visible(self, origins: np.ndarray, directions: np.ndarray, up_to: float | np.ndarray) -> NDArray[np.bool_]:
        """Whether nothing stands within `up_to` metres along each ray."""
        free = np.ones(len(directions), bool)
        origins = np.broadcast_to(np.asarray(origins, np.float32), directions.shape)
        for _, caster in self._parts:
            free &= caster.cast(origins, directions)[0] >= up_to
        return free


def _normals(mesh: Mesh, face: np.ndarray, directions: np.ndarray) -> np.ndarray:
    corners = mesh.vertices[mesh.faces[face]]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(a, b)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    away = np.einsum("ij,ij->i", normal, directions) > 0
    normal[away] *= -1
    return normal
