# SPDX-License-Identifier: MIT
"""A place made of boxes, posts and bushes on ground that may be uneven, ready for ray casting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.simulate.sensing.caster import Part, World
from hybridreg.data.simulate.world.mesh import Mesh
from hybridreg.data.simulate.world.solids import boxes, cards, loft, quads

Array = NDArray[np.float64]
Size = tuple[float, float, float]
_GREY = (0.5, 0.5, 0.5)
# Metres; what stands outdoors goes this deep, so that no ray passes under it where the ground is uneven.
_FOOT = 0.4


@dataclass(eq=False)
class Place:
    """What stands still, what may move between two scans (cars), and where something stands."""

    relief: float = 0.0  # metres, height of the ground relief
    phase: Array = field(default_factory=lambda: np.zeros(3))
    fixed: list[Mesh] = field(default_factory=list)
    loose: list[Mesh] = field(default_factory=list)
    rects: list[tuple[float, float, float, float, float]] = field(default_factory=list)

    def box(self, x: float, y: float, z: float, size: Size, yaw: float = 0.0, loose: bool = False) -> None:
        """A closed box whose lower face is centred at x, y, z; `yaw` in radians."""
        foot = _FOOT if z == 0.0 and self.relief else 0.0
        base = np.array([[x, y, z - foot]])
        mesh = boxes(base, np.add(size, [0.0, 0.0, foot]), yaw, "plaster", _GREY)
        (self.loose if loose else self.fixed).append(_closed(mesh))
        self.rects.append((x, y, size[0] / 2.0, size[1] / 2.0, yaw))

    def post(self, x: float, y: float, radius: float, height: float, z: float = 0.0, sides: int = 12) -> None:
        """An upright cylinder, closed at both ends."""
        foot = _FOOT if z == 0.0 and self.relief else 0.0
        turn = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
        ring = np.c_[x + radius * np.cos(turn), y + radius * np.sin(turn)]
        rings = np.stack([np.c_[ring, np.full(sides, level)] for level in (z - foot, z + height)])
        self.fixed.append(loft(rings, "metal", _GREY))
        self.rects.append((x, y, radius, radius, 0.0))

    def bush(self, centre: Array, radius: float, rng: np.random.Generator) -> None:
        """Leaves in a ball."""
        way = rng.normal(size=(int(120 * radius), 3))
        at = (
            centre
            + way / np.linalg.norm(way, axis=1, keepdims=True) * radius * rng.random((len(way), 1)) ** 0.4
        )
        self.fixed.append(cards(at, np.array([0.2]), rng, "leaves", _GREY))

    def height(self, x: NDArray | float, y: NDArray | float) -> NDArray:
        """Metres of the ground over z = 0."""
        a, b, c = self.phase
        waves = np.sin(0.7 * x + a) + np.sin(0.9 * y + b) + np.sin(0.31 * (x + y) + c)
        return np.asarray(self.relief * waves)

    def ground(self, extent: float) -> None:
        """Ground out to `extent` metres from the middle."""
        axis = np.arange(-extent, extent + 0.5, 1.0) if self.relief else np.array([-extent, extent])
        x, y = np.meshgrid(axis, axis, indexing="ij")
        i = np.arange(x.size).reshape(x.shape)
        corners = [part.ravel() for part in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:])]
        faces = np.r_[np.c_[corners[0], corners[1], corners[2]], np.c_[corners[0], corners[2], corners[3]]]
        points = np.c_[x.ravel(), y.ravel(), self.height(x, y).ravel()]
        self.fixed.append(Mesh.of(points, faces, "ground", _GREY))

    def ceiling(self, half_x: float, half_y: float, z: float) -> None:
        """A ceiling over the middle."""
        x, y = np.array([-1, 1, 1, -1]) * half_x, np.array([-1, -1, 1, 1]) * half_y
        self.fixed.append(quads(np.c_[x, y, np.full(4, z)][None], "plaster", _GREY))

    def free(self, x: float, y: float, clearance: float) -> bool:
        """Whether nothing stands within `clearance` metres of x, y."""
        if not self.rects:
            return True
        rect = np.array(self.rects)
        dx, dy, c, s = x - rect[:, 0], y - rect[:, 1], np.cos(rect[:, 4]), np.sin(rect[:, 4])
        across = np.maximum(np.abs(c * dx + s * dy) - rect[:, 2], 0.0)
        along = np.maximum(np.abs(c * dy - s * dx) - rect[:, 3], 0.0)
        return bool((np.hypot(across, along) > clearance).all())

    @cached_property
    def _still(self) -> Part:
        return Part(Mesh.merge(self.fixed))

    def world(self, rng: np.random.Generator | None = None, clear: Sequence[Array] = ()) -> World:
        """The place at one moment; with `rng` a third of the movable objects have moved by some metres along x.

        Nothing moves to within 4.5 m of where a frame of `clear` (4, 4) stands.
        """
        loose = self.loose if rng is None else [_moved(mesh, rng, clear) for mesh in self.loose]
        return World([self._still, Part(Mesh.merge(loose))] if loose else [self._still])


def _moved(mesh: Mesh, rng: np.random.Generator, clear: Sequence[Array]) -> Mesh:
    if rng.random() > 0.3:
        return mesh
    moved = mesh.moved(0.0, (rng.normal(0.0, 5.0), 0.0, 0.0))
    middle = moved.vertices.mean(axis=0)[:2]
    return mesh if any(np.hypot(*(middle - T[:2, 3])) < 4.5 for T in clear) else moved


def _closed(box: Mesh) -> Mesh:
    # The simulator's boxes are open below.
    below = np.array([[0, 2, 1], [0, 3, 2]])
    lower = Mesh.of(box.vertices[:4], below, "plaster", _GREY)
    return Mesh.merge([box, lower])
