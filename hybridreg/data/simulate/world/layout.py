# SPDX-License-Identifier: MIT
"""The layout of a scene under construction: what stands where, what moves, where a sensor may go."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from hybridreg.data.simulate.world.mesh import Mesh
from hybridreg.data.simulate.world.taken import Taken
from hybridreg.data.simulate.world.uneven_ground import Terrain

# Material index of the ground at x, y.
Surface = Callable[[np.ndarray, np.ndarray], np.ndarray]
# A place for a sensor, drawn at random: x, y.
Stand = Callable[[np.random.Generator], np.ndarray]


@dataclass
class Layout:
    """Ground, static objects, and objects that have moved (or are gone) when the other sensor scans."""

    terrain: Terrain
    surface: Surface
    stand: Stand
    still: list[Mesh] = field(default_factory=list)
    # Moving objects when the source scans (and the image is taken), and the same ones when the target scans.
    at_source: list[Mesh] = field(default_factory=list)
    at_target: list[Mesh] = field(default_factory=list)
    taken: Taken = field(default_factory=Taken)

    def free(self, xy: np.ndarray, radius: float) -> bool:
        """Whether a disc around `xy` (2,) is free."""
        return self.taken.free(xy, radius)

    def claim(self, xy: np.ndarray, half: tuple[float, float], yaw: float = 0.0) -> None:
        """Mark a rectangle as taken."""
        self.taken.add(xy, half, yaw)

    def on_ground(self, thing: Mesh, xy: np.ndarray, yaw: float = 0.0) -> Mesh:
        """`thing` (modelled at the origin) rotated and placed at `xy`."""
        return thing.moved(yaw, (xy[0], xy[1], self.terrain.height_at(xy)))

    def put(self, thing: Mesh, xy: np.ndarray, yaw: float, half: tuple[float, float]) -> bool:
        """Place a static object, unless something is there already; returns whether it was placed."""
        if not self.free(xy, max(half)):
            return False
        self.claim(xy, half, yaw)
        self.still.append(self.on_ground(thing, xy, yaw))
        return True

    def put_mover(
        self,
        thing: Mesh,
        xy: np.ndarray,
        yaw: float,
        step: np.ndarray,
        half: tuple[float, float],
        when: str = "both",
    ) -> bool:
        """Place a moving object: at `xy` for the source scan, at `xy + step` for the target scan.

        when: "both", or "source"/"target" for one that is gone at (or has come by) the other scan.
        """
        if not (self.free(xy, max(half)) and self.free(xy + step, max(half))):
            return False
        for places, moment, at in ((self.at_source, "source", xy), (self.at_target, "target", xy + step)):
            if when in ("both", moment):
                self.claim(at, half, yaw)
                places.append(self.on_ground(thing, at, yaw))
        return True

    def line(self, start: np.ndarray, end: np.ndarray, spacing: float) -> np.ndarray:
        """Points (n,3) on the ground from `start` (2,) to `end` (2,), at least two."""
        n = max(2, round(float(np.linalg.norm(end - start)) / spacing) + 1)
        xy = start + np.linspace(0, 1, n)[:, None] * (end - start)
        return np.column_stack([xy, self.terrain.height(xy[:, 0], xy[:, 1])])
