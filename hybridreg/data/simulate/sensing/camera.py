# SPDX-License-Identifier: MIT
"""The camera image of roughly what the source sees, by an uncalibrated camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from hybridreg.data.simulate.sensing.caster import Hits, World
from hybridreg.data.simulate.sensing.column_arrays import dot, outer, pick, put, stack, turned
from hybridreg.data.simulate.sensing.light import Light
from hybridreg.data.simulate.sensing.scan import with_ground
from hybridreg.data.simulate.world.layout import Surface
from hybridreg.data.simulate.world.materials import COLOUR, GLOSS, GROUND
from hybridreg.data.simulate.world.texture import shade_factor

WIDTH = 512  # pixels of the image
HEIGHT = 288
# Cameras measure one colour per pixel and interpolate the others: images resolve about half of their pixels.
# So do these, which are rendered at the smaller size and enlarged.
ACROSS = 384  # pixels that are rendered
UP = 216
SHADOWS = np.float32(300)  # metres over which objects cast them


@dataclass(frozen=True)
class Camera:
    """Pose and lens; unknown to everything downstream."""

    T_world_camera: np.ndarray  # x forward, y left, z up
    fov_deg: float
    distortion: float

    @staticmethod
    def near(T_world_source: np.ndarray, rng: np.random.Generator) -> Camera:
        """A camera mounted next to the source sensor, some decimetres and degrees off, as on real rigs."""
        T = T_world_source.copy()
        T[:3, 3] += T[:3, :3] @ rng.normal(0, [0.15, 0.2, 0.15])
        aside = np.radians(rng.normal(0, [4.0, 2.5, 1.2]))
        T[:3, :3] = T[:3, :3] @ Rotation.from_euler("ZYX", aside).as_matrix()
        return Camera(T, rng.uniform(62, 96), rng.normal(0, 0.04))

    def rays(self, rng: np.random.Generator) -> np.ndarray:
        """Unit directions (UP*ACROSS,3) float32 in the world, one at a random spot of each pixel."""
        u, v = rng.random((2, UP, ACROSS), dtype=np.float32)
        u += np.arange(-ACROSS / 2, ACROSS / 2, dtype=np.float32)
        v += np.arange(-UP / 2, UP / 2, dtype=np.float32)[:, None]
        u, v = u / np.float32(ACROSS / 2), v / np.float32(ACROSS / 2)
        bulge = (1 + np.float32(self.distortion) * (u * u + v * v)) * np.float32(
            np.tan(np.radians(self.fov_deg) / 2)
        )
        d = stack(np.ones_like(u), -u * bulge, -v * bulge)
        d /= np.sqrt(dot(d, d))[:, None]
        return turned(d, self.T_world_camera[:3, :3])


def render_image(
    world: World, surface: Surface, camera: Camera, light: Light, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """RGB image (288,512,3) uint8 with sun, sky, haze, texture, vignette and noise."""
    rays = camera.rays(rng)
    origin = camera.T_world_camera[:3, 3].astype(np.float32)
    hits = with_ground(world.cast(origin, rays), origin, rays, surface)
    colour = np.empty_like(rays)
    solid, open_sky = np.flatnonzero(hits.face >= 0), np.flatnonzero(hits.face < 0)
    put(colour, open_sky, light.sky(pick(rays, open_sky)))
    put(colour, solid, _surfaces(world, origin, pick(rays, solid), _rows(hits, solid), light))
    return _develop(np.ascontiguousarray(colour).reshape(UP, ACROSS, 3), light, rng)


def _rows(hits: Hits, rows: np.ndarray) -> Hits:
    return Hits(
        hits.distance.take(rows), pick(hits.normal, rows), hits.material.take(rows), hits.face.take(rows)
    )


def _surfaces(world: World, origin: np.ndarray, rays: np.ndarray, hits: Hits, light: Light) -> np.ndarray:
    points = origin + hits.distance[:, None] * rays
    colour = _tints(world, hits) * shade_factor(points, hits.normal, hits.material)[:, None]
    colour *= outer(np.float32(0.75) + np.float32(0.25) * hits.normal[:, 2], light.ambient) + outer(
        _sunlight(world, points, hits.normal, light), light.sunshine
    )
    gloss = GLOSS.take(hits.material)
    shiny = np.flatnonzero(gloss > 0)
    if len(shiny):
        ray, normal = pick(rays, shiny), pick(hits.normal, shiny)
        away = ray - 2 * dot(ray, normal)[:, None] * normal
        plain = pick(colour, shiny)
        put(colour, shiny, plain + gloss[shiny, None] * (light.sky(away) - plain))
    haze = 1 - np.exp(hits.distance / np.float32(-light.visibility))[:, None]
    return np.asarray(colour + haze * (light.horizon - colour))


def _tints(world: World, hits: Hits) -> np.ndarray:
    tint = pick(world.tint, hits.face)
    ground = np.flatnonzero(world.material.take(hits.face) == GROUND)
    put(tint, ground, pick(COLOUR, hits.material.take(ground)))
    return tint


def _sunlight(world: World, points: np.ndarray, normal: np.ndarray, light: Light) -> np.ndarray:
    """Cosine of the sun's incidence (n,), zero in shadow."""
    facing = normal @ light.sun
    sunlight = np.zeros(len(points), np.float32)
    if light.sunshine.max() < 0.02:  # overcast: no shadows to look for
        return sunlight
    lit = np.flatnonzero(facing > 0)
    to_sun = np.broadcast_to(SHADOWS * light.sun, (len(lit), 3))
    off_surface = pick(points, lit) + np.float32(0.03) * pick(normal, lit)
    sunlight[lit] = facing[lit] * world.clear(off_surface, to_sun)
    return sunlight


def _develop(colour: np.ndarray, light: Light, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Lens blur, exposure, white balance, vignette, tone curve, sensor noise."""
    import cv2

    colour = cv2.GaussianBlur(colour, (3, 3), 0.55)
    level = np.percentile(colour[::4, ::4].mean(-1), 65)
    gain = np.float32(0.45 / max(float(level), 1e-3) * light.exposure)
    v, u = np.linspace(-1, 1, UP, dtype=np.float32)[:, None], np.linspace(-1, 1, ACROSS, dtype=np.float32)
    shading = gain * (1 - np.float32(light.vignette) * (u * u + v * v))
    colour *= np.repeat(shading, 3, axis=1).reshape(colour.shape)
    colour *= np.tile(light.white_balance, ACROSS).reshape(ACROSS, 3)
    curve = np.sqrt(np.maximum(colour / (1 + np.float32(0.35) * colour), 0))
    curve += rng.standard_normal(colour.shape, dtype=np.float32) * np.float32(light.noise)
    small = (np.clip(curve, 0, 1) * 255).astype(np.uint8)
    enlarged: NDArray[np.uint8] = cv2.resize(small, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)
    return enlarged
