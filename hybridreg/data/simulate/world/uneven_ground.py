# SPDX-License-Identifier: MIT
"""Uneven ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybridreg.data.simulate.world.mesh import Mesh

EXTENT = 130.0  # metres from the centre to the rim of every scene
_AXIS = np.concatenate(
    [np.arange(-EXTENT, -42, 8.0), np.arange(-42, 42.1, 2.0), np.arange(EXTENT, 42, -8.0)[::-1]]
)


@dataclass(frozen=True)
class Terrain:
    """Height as a sum of a slope and a few long waves, the same formula for objects, sensors and triangles."""

    slope: np.ndarray  # (2,) rise per metre
    wave: np.ndarray  # (k,4): amplitude in metres, two wave numbers, phase

    @staticmethod
    def draw(rng: np.random.Generator, relief: float) -> Terrain:
        """Waves of 15 to 90 m; `relief` scales their height (0.3 for streets, 1 for parks)."""
        length = rng.uniform(15, 90, 7)
        angle = rng.uniform(0, 2 * np.pi, 7)
        number = 2 * np.pi / length
        amplitude = relief * rng.uniform(0.2, 1.0, 7) * length / 110
        wave = np.c_[amplitude, number * np.cos(angle), number * np.sin(angle), rng.uniform(0, 6.28, 7)]
        return Terrain(rng.normal(0, 0.018 * (0.5 + relief), 2), wave)

    def height(self, x: np.ndarray | float, y: np.ndarray | float) -> np.ndarray:
        """Metres above the datum at `x`, `y` (any one shape)."""
        x, y = np.asarray(x, float)[..., None], np.asarray(y, float)[..., None]
        a, kx, ky, phase = self.wave.T
        return (
            self.slope[0] * x[..., 0]
            + self.slope[1] * y[..., 0]
            + (a * np.sin(kx * x + ky * y + phase)).sum(-1)
        )

    def height_at(self, xy: np.ndarray) -> float:
        """Metres above the datum at one place (2,): the same number, several times as fast."""
        x, y = float(xy[0]), float(xy[1])
        a, kx, ky, phase = self.wave.T
        waves = (a * np.sin(kx * x + ky * y + phase)).sum()
        return float(self.slope[0] * x + self.slope[1] * y + waves)

    def mesh(self, rng: np.random.Generator, bumps: float) -> Mesh:
        """Triangles out to the rim, fine near the centre, with `bumps` metres of small unevenness.

        Which part is road and which is lawn is looked up in the layout per hit, finer than any triangle.
        """
        x, y = np.meshgrid(_AXIS, _AXIS, indexing="ij")
        z = self.height(x, y) + rng.normal(0, bumps, x.shape)
        n = len(_AXIS)
        i = np.arange(n * n).reshape(n, n)
        a, b, c, d = (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:])
        faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
        return Mesh.of(np.stack([x, y, z], -1).reshape(-1, 3), faces, "ground", (0.5, 0.5, 0.5))
