# SPDX-License-Identifier: MIT
"""Ray casting by Embree, through open3d where it is installed, otherwise through the `embreex` wheel.

Both gave the same bits wherever they were compared; open3d takes over a scene in a millisecond, embreex copies it
number by number.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.simulate.sensing.column_arrays import dot, pick
from hybridreg.data.simulate.world.mesh import Mesh
from hybridreg.data.simulate.world.solids import cross


@dataclass(frozen=True)
class Hits:
    """First surface along each ray: distance (n,) metres, inf where there is none; unit normal (n,3) towards
    the ray's start; material (n,); index (n,) of the face in its world, -1 where there is none."""

    distance: NDArray[np.float32]
    normal: NDArray[np.float32]
    material: NDArray[np.uint8]
    face: NDArray[np.int32]


class Caster(Protocol):
    """Nearest triangle along rays (n,6) float32: a start and a direction, whose length is the unit of `t`."""

    def cast(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`t` (n,) float32 (inf where none) and face index (n,) int32 (-1 where none) of the first triangle."""

    def blocked(self, rays: np.ndarray) -> np.ndarray:
        """Whether a triangle lies between t = 0 and t = 1, (n,) bool."""


class EmbreexCaster:
    """Embree through the embreex wheel (10 MB, no other dependency)."""

    def __init__(self, mesh: Mesh) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene = EmbreeScene()
        TriangleMesh(self._scene, np.ascontiguousarray(mesh.vertices), np.ascontiguousarray(mesh.faces))

    def cast(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Caster.cast`."""
        start, direction = np.ascontiguousarray(rays[:, :3]), np.ascontiguousarray(rays[:, 3:])
        found = self._scene.run(start, direction, output=1)
        face = found["primID"].astype(np.int32)
        return np.where(face >= 0, found["tfar"], np.float32(np.inf)), face

    def blocked(self, rays: np.ndarray) -> np.ndarray:
        """See `Caster.blocked`."""
        blocked: np.ndarray = self.cast(rays)[0] < 1
        return blocked


class Open3dCaster:
    """Embree as bundled with open3d."""

    def __init__(self, mesh: Mesh) -> None:
        from hybridreg.runtime.open3d import load_open3d

        open3d = load_open3d()
        self._tensor = open3d.core.Tensor
        # Embree's own threads would fight over the cores with the other workers.
        self._scene = open3d.t.geometry.RaycastingScene(nthreads=1)
        vertices, faces = np.ascontiguousarray(mesh.vertices), mesh.faces.astype(np.uint32)
        self._scene.add_triangles(self._tensor(vertices), self._tensor(faces))

    def cast(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Caster.cast`."""
        found = self._scene.cast_rays(self._tensor.from_numpy(rays))
        # Open3D's marker of a miss, 2^32 - 1, is -1 when read as a signed number.
        return found["t_hit"].numpy(), found["primitive_ids"].numpy().view(np.int32)

    def blocked(self, rays: np.ndarray) -> np.ndarray:
        """See `Caster.blocked`."""
        blocked: np.ndarray = self._scene.test_occlusions(self._tensor.from_numpy(rays), 0.0, 1.0).numpy()
        return blocked


def make_caster(mesh: Mesh) -> Caster:
    """The first caster that this machine has.

    Raises
    ------
    ImportError
        Where neither `open3d` nor `embreex` can be loaded.
    """
    try:
        return Open3dCaster(mesh)
    except ImportError:
        pass
    try:
        return EmbreexCaster(mesh)
    except ImportError as error:
        raise ImportError(f"the simulator needs Embree, run `pip install embreex` ({error})") from error


class Part:
    """A mesh with its caster and face normals, made once and used by every world it is part of."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.normals = _face_normals(mesh)
        self.caster = make_caster(mesh)


def _face_normals(mesh: Mesh) -> NDArray[np.float32]:
    vertices = np.asfortranarray(mesh.vertices)
    a, b, c = (pick(vertices, mesh.faces[:, k]) for k in range(3))
    normal = np.asfortranarray(cross(b - a, c - a))
    return normal / np.maximum(np.sqrt(dot(normal, normal)), 1e-12)[:, None]


class World:
    """Static and moving geometry at one moment, ready for ray casting."""

    def __init__(self, parts: list[Part]) -> None:
        parts = [part for part in parts if len(part.mesh.faces)]
        self._parts = parts
        self._first = np.cumsum([0] + [len(part.mesh.faces) for part in parts[:-1]], dtype=np.int32)
        self._normal = np.concatenate([part.normals.T for part in parts], axis=1).T
        self.material = np.concatenate([part.mesh.material for part in parts])
        self.tint = np.concatenate([part.mesh.tint for part in parts])

    def cast(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """First hits of rays from `origins` (n,3) or (3,) along unit `directions` (n,3)."""
        rays = _rays(origins, directions)
        distance, face = self._parts[0].caster.cast(rays)
        for first, part in zip(self._first[1:], self._parts[1:], strict=True):
            t, other = part.caster.cast(rays)
            nearer = np.flatnonzero(t < distance)
            distance[nearer] = t[nearer]
            face[nearer] = other[nearer] + first
        normal = pick(self._normal, face)  # a ray without a hit has face -1: its normal is never used
        normal *= np.copysign(np.float32(1), -dot(normal, directions))[:, None]
        return Hits(distance, normal, self.material.take(face, mode="wrap"), face)

    def clear(self, origins: np.ndarray, segments: np.ndarray) -> NDArray[np.bool_]:
        """Whether the segments (n,3) are unobstructed, from `origins` (n,3) or (3,) to `origins + segments`."""
        rays = _rays(origins, segments)
        clear = np.arange(len(rays))
        for part in self._parts:
            clear = clear[~part.caster.blocked(rays.take(clear, axis=0))]
        result = np.zeros(len(rays), bool)
        result[clear] = True
        return result


def _rays(origins: np.ndarray, directions: np.ndarray) -> NDArray[np.float32]:
    rays = np.empty((len(directions), 6), np.float32)
    for k in range(3):  # three times as fast as both halves at once
        rays[:, k], rays[:, 3 + k] = origins[..., k], directions[:, k]
    return rays
