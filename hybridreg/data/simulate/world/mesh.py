# SPDX-License-Identifier: MIT
"""Triangles with a material and a tint: what every simulated object is made of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.simulate.world.materials import MATERIAL_INDEX

Tint = tuple[float, float, float]
Colour = Sequence[float] | NDArray[Any]  # red, green, blue in [0,1]


@dataclass(frozen=True)
class Mesh:
    """vertices (V,3) float32 in metres, faces (F,3) int32, material (F,) uint8, tint (F,3) float32 in [0,1].

    Vertices and tints come out of `merge` and `moved` stored column by column.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    material: NDArray[np.uint8]
    tint: NDArray[np.float32]

    @staticmethod
    def of(vertices: np.ndarray, faces: np.ndarray, material: str, tint: Colour) -> Mesh:
        """One piece of one material."""
        tints = np.empty((len(faces), 3), np.float32)
        tints[:] = tint
        return Mesh(
            np.asarray(vertices, np.float32),
            np.asarray(faces, np.int32),
            np.full(len(faces), MATERIAL_INDEX[material], np.uint8),
            tints,
        )

    @staticmethod
    def merge(parts: Iterable[Mesh]) -> Mesh:
        """All parts as one mesh; no parts give an empty mesh."""
        pieces = [part for part in parts if len(part.faces)]
        if not pieces:
            return EMPTY
        starts = np.cumsum([0] + [len(p.vertices) for p in pieces[:-1]])
        return Mesh(
            np.concatenate([p.vertices.T for p in pieces], axis=1).T,
            np.concatenate([p.faces + np.int32(s) for p, s in zip(pieces, starts, strict=True)]),
            np.concatenate([p.material for p in pieces]),
            np.concatenate([p.tint.T for p in pieces], axis=1).T,
        )

    def moved(self, yaw: float, offset: Sequence[float]) -> Mesh:
        """Turned by `yaw` radians about z, then shifted by `offset` (3,)."""
        c, s = np.cos(yaw), np.sin(yaw)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], np.float32)
        x, y, z = offset
        vertices = turn @ self.vertices.T
        vertices += np.array([[x], [y], [z]], np.float32)
        return Mesh(vertices.T, self.faces, self.material, self.tint)


EMPTY = Mesh(
    np.zeros((0, 3), np.float32),
    np.zeros((0, 3), np.int32),
    np.zeros(0, np.uint8),
    np.zeros((0, 3), np.float32),
)
