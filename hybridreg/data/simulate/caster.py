# SPDX-License-Identifier: MIT
"""Ray casting by Embree: the `embreex` wheel where it is installed, else open3d."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.simulate.mesh import Mesh
from hybridreg.data.simulate.solids import cross


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
        self._scene.add_triangles(
            self._core.Tensor(mesh.vertices), self._core.Tensor(mesh.faces.astype(np.uint32))
        )

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


class Part:
    """A mesh with its caster and face normals, made once and used by every world it is part of."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.normals = _face_normals(mesh)
        self.caster = make_caster(mesh)


def _face_normals(mesh: Mesh) -> NDArray[np.float32]:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normal = cross(b - a, c - a)
    return normal / np.maximum(np.sqrt(np.einsum("ij,ij->i", normal, normal)), 1e-12)[:, None]


class World:
    """Still and moving geometry as it stands at one moment, ready for rays."""

    def __init__(self, parts: list[Part]) -> None:
        parts = [part for part in parts if len(part.mesh.faces)]
        self._casters = [part.caster for part in parts]
        self._first = np.cumsum([0] + [len(part.mesh.faces) for part in parts[:-1]])
        self._normal = np.concatenate([part.normals for part in parts])
        self._material = np.concatenate([part.mesh.material for part in parts])
        self._tint = np.concatenate([part.mesh.tint for part in parts])

    def cast(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """First hits of rays from `origins` (n,3) or (3,) along unit `directions` (n,3)."""
        origins = _starts(origins, directions)
        distance, face = self._casters[0].cast(origins, directions)
        for first, caster in zip(self._first[1:], self._casters[1:], strict=True):
            t, other = caster.cast(origins, directions)
            nearer = t < distance
            distance = np.where(nearer, t, distance)
            face = np.where(nearer, other + first, face)
        normal = self._normal[face]  # a ray without a hit has face -1: its normal is never used
        away = np.einsum("ij,ij->i", normal, directions) > 0
        normal[away] *= -1
        return Hits(distance, normal, self._material[face], self._tint[face])

    def visible(
        self, origins: np.ndarray, directions: np.ndarray, up_to: np.ndarray | float
    ) -> NDArray[np.bool_]:
        """Whether nothing stands within `up_to` metres along each ray."""
        free = np.ones(len(directions), bool)
        origins = _starts(origins, directions)
        for caster in self._casters:
            free[free] = (
                caster.cast(origins[free], directions[free])[0] >= np.broadcast_to(up_to, free.shape)[free]
            )
        return free


def _starts(origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(np.broadcast_to(np.asarray(origins, np.float32), directions.shape))
