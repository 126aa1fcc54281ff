# SPDX-License-Identifier: MIT
"""A photograph of roughly what the source sees, by an uncalibrated camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from hybridreg.data.simulate.caster import Hits, World
from hybridreg.data.simulate.layout import Surface
from hybridreg.data.simulate.light import Light
from hybridreg.data.simulate.materials import GLOSS
from hybridreg.data.simulate.scan import with_ground
from hybridreg.data.simulate.texture import shade_factor

WIDTH, HEIGHT = 512, 288


@dataclass(frozen=True)
class Camera:
    """Pose and lens; nobody downstream is told them."""

    T_world_camera: np.ndarray  # x forward, y left, z up
    fov_deg: float
    distortion: float

    @staticmethod
    def near(T_world_source: np.ndarray, rng: np.random.Generator) -> Camera:
        """A camera mounted by the source: some decimetres and degrees off, as rigs are."""
        T = T_world_source.copy()
        T[:3, 3] += T[:3, :3] @ rng.normal(0, [0.15, 0.2, 0.15])
        aside = np.radians(rng.normal(0, [4.0, 2.5, 1.2]))
        T[:3, :3] = T[:3, :3] @ Rotation.from_euler("ZYX", aside).as_matrix()
        return Camera(T, rng.uniform(62, 96), rng.normal(0, 0.04))

    def rays(self, rng: np.random.Generator) -> np.ndarray:
        """Unit directions (H*W,3) in the world, one at a random spot of each pixel."""
        spot = rng.random((2, HEIGHT, WIDTH), dtype=np.float32)
        u = (np.arange(WIDTH) + spot[0] - WIDTH / 2) / (WIDTH / 2)
        v = (np.arange(HEIGHT)[:, None] + spot[1] - HEIGHT / 2) / (WIDTH / 2)
        bulge = (1 + self.distortion * (u**2 + v**2)) * np.tan(np.radians(self.fov_deg) / 2)
        d = np.stack([np.ones_like(u), -u * bulge, -v * bulge], -1).reshape(-1, 3)
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        return (d @ self.T_world_camera[:3, :3].T).astype(np.float32)


def photograph(
    world: World, surface: Surface, camera: Camera, light: Light, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """RGB picture (288,512,3) uint8 with sun, sky, haze, texture, vignette and noise."""
    rays = camera.rays(rng)
    origin = camera.T_world_camera[:3, 3]
    hits = world.cast(origin, rays)
    hits = with_ground(hits, origin, rays, surface)
    colour = np.empty_like(rays)
    solid, open_sky = (np.flatnonzero(m) for m in (np.isfinite(hits.distance), np.isinf(hits.distance)))
    colour[open_sky] = light.sky(rays[open_sky])
    colour[solid] = _surfaces(world, origin, rays[solid], _rows(hits, solid), light)
    return _develop(colour.reshape(HEIGHT, WIDTH, 3), light, rng)


def _rows(hits: Hits, rows: np.ndarray) -> Hits:
    return Hits(hits.distance[rows], hits.normal[rows], hits.material[rows], hits.tint[rows])


def _surfaces(world: World, origin: np.ndarray, rays: np.ndarray, hits: Hits, light: Light) -> np.ndarray:
    points = (origin + hits.distance[:, None] * rays).astype(np.float32)
    sunlight = _sunlight(world, points, hits.normal, light)
    shade = light.ambient * (0.75 + 0.25 * hits.normal[:, 2:3]) + light.sunshine * sunlight[:, None]
    colour = hits.tint * shade_factor(points, hits.normal, hits.material)[:, None] * shade
    gloss = GLOSS[hits.material]
    shiny = np.flatnonzero(gloss > 0)
    if len(shiny):
        away = (
            rays[shiny]
            - 2 * np.sum(rays[shiny] * hits.normal[shiny], axis=1, keepdims=True) * hits.normal[shiny]
        )
        colour[shiny] += gloss[shiny, None] * (light.sky(away) - colour[shiny])
    haze = 1 - np.exp(-hits.distance / light.visibility)[:, None]
    return colour + haze * (light.horizon - colour)


def _sunlight(world: World, points: np.ndarray, normal: np.ndarray, light: Light) -> np.ndarray:
    """Cosine of the sun's incidence (n,), zero in shadow."""
    facing = normal @ light.sun
    sunlight = np.zeros(len(points), np.float32)
    if light.sunshine.max() < 0.02:  # overcast: no shadows to look for
        return sunlight
    lit = np.flatnonzero(facing > 0)
    to_sun = np.broadcast_to(light.sun, (len(lit), 3))
    sunlight[lit] = facing[lit] * world.visible(points[lit] + 0.03 * normal[lit], to_sun, np.inf)
    return sunlight


def _develop(colour: np.ndarray, light: Light, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Lens blur, exposure, white balance, vignette, tone curve, sensor noise."""
    import cv2

    colour = cv2.GaussianBlur(colour, (3, 3), 0.55)
    level = np.percentile(colour[::4, ::4].mean(-1), 65)
    gain = np.float32(0.45 / max(float(level), 1e-3) * light.exposure)
    v, u = np.linspace(-1, 1, HEIGHT, dtype=np.float32)[:, None], np.linspace(-1, 1, WIDTH, dtype=np.float32)
    colour = colour * (gain * (1 - light.vignette * (u**2 + v**2)))[..., None] * light.white_balance
    curve = np.sqrt(np.maximum(colour / (1 + 0.35 * colour), 0))
    noise = rng.standard_normal(colour.shape, dtype=np.float32) * light.noise
    return (np.clip(curve + noise, 0, 1) * 255).astype(np.uint8)
