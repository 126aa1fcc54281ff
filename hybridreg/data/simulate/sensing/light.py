# SPDX-License-Identifier: MIT
"""Sun, sky, haze and the camera's exposure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybridreg.data.simulate.sensing.column_arrays import outer
from hybridreg.data.simulate.world.texture import noise_at


@dataclass(frozen=True)
class Light:
    """The weather and the camera's settings, drawn together."""

    sun: np.ndarray  # (3,) towards the sun
    sunshine: np.ndarray  # (3,) its colour and strength, zero under cloud
    ambient: np.ndarray  # (3,) from the sky
    zenith: np.ndarray  # (3,)
    horizon: np.ndarray  # (3,)
    clouds: float  # cover in [0,1]
    drift: np.ndarray  # (2,) where the clouds are
    visibility: float  # metres
    exposure: float
    white_balance: np.ndarray  # (3,)
    vignette: float
    noise: float

    @staticmethod
    def draw(rng: np.random.Generator) -> Light:
        """From a clear summer noon to a grey afternoon."""
        height, turn = np.radians(rng.uniform(12, 65)), rng.uniform(0, 2 * np.pi)
        clouds = float(rng.choice([rng.uniform(0, 0.4), rng.uniform(0.4, 0.8), 1.0], p=[0.45, 0.25, 0.3]))
        warm = _rgb(1.0, 0.93, 0.80) if height < 0.5 else _rgb(1.0, 0.97, 0.92)
        blue = _rgb(0.28, 0.48, 0.86) * np.float32(rng.uniform(0.8, 1.1))
        clear, dull = _rgb(0.78, 0.86, 0.95), _rgb(0.86, 0.87, 0.88)
        sunshine = 1.25 * max(0.0, 1 - clouds**2) * rng.uniform(0.7, 1.1)
        return Light(
            sun=_rgb(np.cos(height) * np.cos(turn), np.cos(height) * np.sin(turn), np.sin(height)),
            sunshine=warm * np.float32(sunshine),
            ambient=_rgb(0.38, 0.41, 0.46) * np.float32(1 + 0.9 * clouds),
            zenith=blue + (_rgb(0.80, 0.83, 0.87) - blue) * np.float32(clouds**1.5),
            horizon=clear + (dull - clear) * np.float32(clouds),
            clouds=clouds,
            drift=rng.uniform(0, 1000, 2).astype(np.float32),
            visibility=float(np.exp(rng.uniform(np.log(150), np.log(1500)))),
            exposure=rng.uniform(0.75, 1.3),
            white_balance=(1 + rng.normal(0, 0.04, 3)).astype(np.float32),
            vignette=rng.uniform(0.02, 0.14),
            noise=float(np.exp(rng.uniform(np.log(0.003), np.log(0.018)))),
        )

    def sky(self, rays: np.ndarray) -> np.ndarray:
        """Colour (n,3) of the sky along `rays` (n,3), with clouds on a layer overhead."""
        up = np.clip(rays[:, 2], 0.0, 1.0)
        colour = self.horizon + outer(np.sqrt(up), self.zenith - self.horizon)
        x, y = (rays[:, k] / np.maximum(up, 0.03) * 120 + self.drift[k] for k in range(2))
        puff = noise_at(x, y, 600.0)
        cover = np.clip((puff + 2.4 * self.clouds - 1.2) * 0.8, 0, 1) * np.clip(up * 8, 0, 1)
        colour += cover[:, None] * (outer(0.82 + 0.1 * puff, _rgb(1.0, 1.0, 1.02)) - colour)
        glow = np.clip(rays @ self.sun, 0, 1) ** 60 * np.float32(0.8 * (1 - self.clouds))
        return np.asarray(colour + glow[:, None], np.float32)


def _rgb(red: float, green: float, blue: float) -> np.ndarray:
    return np.array([red, green, blue], np.float32)
